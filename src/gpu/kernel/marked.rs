//! Kernels that mark which elements of their buffers they read and which they write, so that a test can count what a frame moves.
//!
//! The text of a kernel is changed for that: `list[at]` becomes `list[mark(k, at)]`, and `mark` sets a bit in one more buffer.

use super::Kernel;
use crate::error::GpuError;
use crate::gpu::device::Gpu;
use crate::gpu::transfer::Transfer;
use std::cell::{Cell, RefCell};
use std::sync::Arc;
use wgpu::util::DeviceExt;

/// An array of a shader that is in a buffer.
#[derive(Debug)]
struct Array {
    binding: u32,
    name: String,
    /// Bytes of an element.
    element: u64,
}

/// The arrays of a shader in buffers.
#[derive(Debug, Clone)]
pub(in crate::gpu) struct Arrays(Arc<Vec<Array>>);

/// The marks of a kernel and its buffers.
#[derive(Debug)]
pub(in crate::gpu) struct Marks {
    kernel: &'static str,
    arrays: Arrays,
    /// For each array where its elements that were read begin, and where those that were written do, in words; then a bit for each.
    buffer: wgpu::Buffer,
    begins: Vec<usize>,
    group: wgpu::BindGroup,
}

std::thread_local! {
    static MARKING: Cell<bool> = const { Cell::new(false) };
    /// Of each dispatch of a marked kernel that this thread has recorded.
    static DISPATCHED: RefCell<Vec<Arc<Marks>>> = const { RefCell::new(Vec::new()) };
}

/// Does something whose kernels, those that this thread compiles, mark what they touch.
pub(in crate::gpu) fn marking<T>(work: impl FnOnce() -> T) -> T {
    MARKING.set(true);
    let made = work();
    MARKING.set(false);
    made
}

/// For each dispatch of a kernel with marks since the last call its name, and the bytes of the elements that it has read and of those that it has
/// written. Waits for them.
pub(in crate::gpu) fn moved(gpu: &Gpu) -> Result<Vec<(&'static str, f64)>, GpuError> {
    let dispatched = DISPATCHED.take();
    let mut download = Transfer::download(gpu)?;
    dispatched
        .iter()
        .map(|marks| {
            let bytes = marks.buffer.size();
            download.ensure(gpu, bytes)?;
            download.unmap();
            let mut encoder = gpu.record();
            encoder.copy_buffer_to_buffer(&marks.buffer, 0, download.buffer(), 0, bytes);
            // Whoever dispatches the kernel again begins anew.
            encoder.clear_buffer(&marks.buffer, marks.begins[0] as u64 * 4, None);
            let submission = gpu.submit(encoder)?;
            download.ask(gpu, bytes);
            gpu.wait(submission)?;
            let view = download.readable(gpu, 0..bytes)?;
            Ok((marks.kernel, marks.bytes(bytemuck::cast_slice(&view))))
        })
        .collect()
}

/// The text of a kernel that marks what it touches, and its arrays; the same text and `None` where nothing is to be marked.
pub(super) fn text_and_arrays(text: String) -> (String, Option<Arrays>) {
    if !MARKING.get() {
        return (text, None);
    }
    let code: String = text.lines().map(|line| format!("{}\n", line.split("//").next().unwrap_or_default())).collect();
    let arrays: Vec<Array> = code.lines().filter_map(|line| declared(line.trim_end())).collect();
    (format!("{}{MARK}", marked(&code, &arrays)), Some(Arrays(arrays.into())))
}

/// A mark that is there is not set again, because invocations that set the same word wait for each other.
const MARK: &str = "
@group(1) @binding(0) var<storage, read_write> marks: array<atomic<u32>>;
fn mark(list: u32, at: u32) -> u32 {
    let word = atomicLoad(&marks[list]) + at / 32u;
    let bit = 1u << (at % 32u);
    if ((atomicLoad(&marks[word]) & bit) == 0u) {
        atomicOr(&marks[word], bit);
    }
    return at;
}
fn mark_both(list: u32, at: u32) -> u32 {
    return mark(list + 1u, mark(list, at));
}
";

/// The array that a line declares, if it declares one in a buffer. The header is none.
fn declared(line: &str) -> Option<Array> {
    let (binding, rest) = line.split_once(" var<storage, ")?;
    let (name, kind) =
        rest.split_once("> ").and_then(|(_, rest)| rest.split_once(": ")).expect("a declaration has a type");
    let element = match kind {
        "Header;" => return None,
        "array<u32>;" | "array<atomic<u32>>;" => 4,
        "array<vec2<u32>>;" => 8,
        "array<vec4<u32>>;" => 16,
        "array<Box>;" => 32,
        other => panic!("the size of an element of {other} is not known"),
    };
    let number = binding.strip_prefix("@group(0) @binding(").and_then(|rest| rest.strip_suffix(")")?.parse().ok());
    Some(Array { binding: number.expect("a buffer has a number"), name: name.to_owned(), element })
}

/// Code in which each access to an array marks the element.
fn marked(code: &str, arrays: &[Array]) -> String {
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut text = String::new();
    let mut rest = code;
    while let Some(open) = rest.find('[') {
        let (before, behind) = rest.split_at(open);
        let name = before.rsplit(|c| !is_name(c)).next().unwrap_or_default();
        let mut depth = 0_i32;
        let close = behind.find(|c| {
            depth += i32::from(c == '[') - i32::from(c == ']');
            depth == 0
        });
        let close = close.expect("each bracket is closed");
        let (index, after) = (marked(&behind[1..close], arrays), &behind[close + 1..]);
        text += before;
        match arrays.iter().position(|a| a.name == name) {
            Some(k) => {
                let (function, list) = match access(before.strip_suffix(name).unwrap_or_default(), after) {
                    Access::Read => ("mark", 2 * k),
                    Access::Write => ("mark", 2 * k + 1),
                    Access::Both => ("mark_both", 2 * k),
                };
                text += &format!("[{function}({list}u, {index})]");
            }
            None => text += &format!("[{index}]"),
        }
        rest = after;
    }
    text + rest
}

#[derive(Debug, PartialEq)]
enum Access {
    Read,
    Write,
    Both,
}

/// How an element is accessed that stands between these.
fn access(before: &str, after: &str) -> Access {
    if let Some(call) = before.strip_suffix("(&") {
        return match call {
            _ if call.ends_with("atomicLoad") => Access::Read,
            _ if call.ends_with("atomicStore") => Access::Write,
            _ => Access::Both,
        };
    }
    let behind_members =
        after.trim_start_matches(|c: char| c.is_ascii_alphanumeric() || c == '.' || c == '_').trim_start();
    let operator: String = behind_members.chars().take_while(|c| "=+-*/%&|^<>!".contains(*c)).collect();
    match operator.as_str() {
        "=" => Access::Write,
        "++" | "--" | "+=" | "-=" | "*=" | "/=" | "%=" | "&=" | "|=" | "^=" | "<<=" | ">>=" => Access::Both,
        _ => Access::Read,
    }
}

impl Arrays {
    /// Marks for a kernel with these buffers.
    pub(super) fn bind(
        &self,
        gpu: &Gpu,
        kernel: &Kernel,
        buffers: &[(u32, &wgpu::Buffer)],
    ) -> Result<Arc<Marks>, GpuError> {
        let mut begins = vec![2 * self.0.len()];
        for array in self.0.iter() {
            let bound = buffers.iter().find(|(binding, _)| *binding == array.binding);
            let words = bound.map_or(0, |(_, buffer)| (buffer.size() / array.element).div_ceil(32)) as usize;
            let begin = begins.last().copied().unwrap_or_default();
            begins.extend([begin + words, begin + 2 * words]);
        }
        let words: Vec<u32> =
            (0..begins[begins.len() - 1]).map(|k| if k < begins[0] { begins[k] as u32 } else { 0 }).collect();
        let buffer = gpu.try_make(|device| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("marks"),
                contents: bytemuck::cast_slice(&words),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            })
        })?;
        let group = gpu.try_make(|device| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("marks"),
                layout: &kernel.pipeline.get_bind_group_layout(1),
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
            })
        })?;
        Ok(Arc::new(Marks { kernel: kernel.label, arrays: self.clone(), buffer, begins, group }))
    }
}

impl Marks {
    /// Notes a dispatch that is being recorded.
    pub(super) fn dispatch(self: &Arc<Self>, pass: &mut wgpu::ComputePass<'_>) {
        pass.set_bind_group(1, &self.group, &[]);
        DISPATCHED.with_borrow_mut(|dispatched| dispatched.push(Arc::clone(self)));
    }

    /// Bytes of the elements that were read, and of those that were written.
    fn bytes(&self, words: &[u32]) -> f64 {
        let marks =
            |k: usize| words[self.begins[k]..self.begins[k + 1]].iter().map(|w| u64::from(w.count_ones())).sum::<u64>();
        let bytes = |(k, array): (usize, &Array)| (marks(2 * k) + marks(2 * k + 1)) * array.element;
        self.arrays.0.iter().enumerate().map(bytes).sum::<u64>() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_access_is_marked_as_what_it_is() {
        let text = "\
@group(0) @binding(3) var<storage, read> a: array<u32>; // a[0] is a comment
@group(0) @binding(7) var<storage, read_write> b: array<vec2<u32>>;
var<workgroup> c: array<u32, 4>;
fn f() {
    b[a[c[0]] + 1u].y = a[2];
    if (b[4].x == 5u) { b[6] += ab[7]; atomicAdd(&a[8], atomicLoad(&a[9])); atomicStore(&a[10], 1u); }
}
";
        let (same, none) = text_and_arrays(text.to_owned());
        assert!(same == text && none.is_none());
        let (text, arrays) = marking(|| text_and_arrays(text.to_owned()));
        let arrays: Vec<(u32, String, u64)> =
            arrays.unwrap().0.iter().map(|a| (a.binding, a.name.clone(), a.element)).collect();
        assert_eq!(arrays, [(3, "a".to_owned(), 4), (7, "b".to_owned(), 8)]);
        assert!(!text.contains("comment"));
        for line in [
            "    b[mark(3u, a[mark(0u, c[0])] + 1u)].y = a[mark(0u, 2)];\n",
            "(b[mark(2u, 4)].x == 5u) { b[mark_both(2u, 6)] += ab[7]; atomicAdd(&a[mark_both(0u, 8)], ",
            "atomicLoad(&a[mark(0u, 9)])); atomicStore(&a[mark(1u, 10)], 1u); }",
        ] {
            assert!(text.contains(line), "{text}");
        }
    }
}
