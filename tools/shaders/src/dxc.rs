//! Microsoft's compiler DXC, which wgpu uses on Windows, as a library for Linux. This is version 3.7, whose
//! interfaces have C++'s two destructors behind the three functions of `IUnknown`. Crates for newer versions crash in
//! it.

use crate::Result;
use std::ffi::c_void;
use std::path::Path;
use std::ptr::{null_mut, read};

/// An identifier of COM, in the memory layout of little-endian machines.
type Guid = (u32, u16, u16, [u8; 8]);
const COMPILER: Guid = (0x73e22d93, 0xe6ce, 0x47f3, [0xb5, 0xbf, 0xf0, 0x66, 0x4f, 0x39, 0xc1, 0xb0]);
const I_COMPILER: Guid = (0x228b4687, 0x5a6a, 0x4730, [0x90, 0x0c, 0x97, 0x02, 0xb2, 0x20, 0x3f, 0x54]);
const I_RESULT: Guid = (0x58346cda, 0xdde7, 0x4497, [0x94, 0x61, 0x6f, 0x87, 0xaf, 0x5e, 0x06, 0x59]);
const UTF_8: u32 = 65001;

/// An object of COM. Its first word points to its functions.
type Object = *mut *const Functions;
/// The functions of an object: those of `IUnknown`, the destructors, then its own.
#[repr(C)]
struct Functions {
    unknown: [usize; 5],
    first: usize,
    second: usize,
    third: usize,
}

#[repr(C)]
struct Source {
    text: *const u8,
    bytes: usize,
    encoding: u32,
}

type Create = unsafe extern "C" fn(*const Guid, *const Guid, *mut Object) -> i32;
type Compile =
    unsafe extern "C" fn(Object, *const Source, *const *const i32, u32, *mut c_void, *const Guid, *mut Object) -> i32;
type Get<T> = unsafe extern "C" fn(Object, *mut T) -> i32;
type Pointer = unsafe extern "C" fn(Object) -> *const u8;
type Size = unsafe extern "C" fn(Object) -> usize;

/// Compiles every file `NAME.ENTRY.hlsl` of a folder to DXIL.
pub(crate) fn all(library: &Path, dir: &Path) -> Result<()> {
    // SAFETY: DXC's initialisers set up LLVM and nothing else. It stays loaded until the process ends.
    let loaded = unsafe { libloading::Library::new(library) }
        .map_err(|e| format!("{} does not load: {e}", library.display()))?;
    // SAFETY: dxcapi.h declares it so.
    let create =
        unsafe { loaded.get::<Create>(b"DxcCreateInstance") }.map_err(|e| format!("{}: {e}", library.display()))?;
    let mut compiler: Object = null_mut();
    // SAFETY: as above.
    let status = unsafe { create(&COMPILER, &I_COMPILER, &mut compiler) };
    if status != 0 {
        return Err(format!("{} has no compiler ({status:#x})", library.display()));
    }
    let files = crate::files(dir, "hlsl")?;
    for file in &files {
        let name = crate::stem(file);
        let entry = name.rsplit('.').next().unwrap_or_default();
        let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
        // SAFETY: `create` made the compiler.
        unsafe { compile(compiler, &text, entry) }.map_err(|why| format!("DXC refuses {name}: {why}"))?;
    }
    println!("{} kernels through DXC", files.len());
    Ok(())
}

/// Compiles one entry point, with the arguments of wgpu-hal.
///
/// # Safety
/// The object is an `IDxcCompiler3` of version 3.7.
unsafe fn compile(compiler: Object, text: &str, entry: &str) -> Result<()> {
    let source = Source { text: text.as_ptr(), bytes: text.len(), encoding: UTF_8 };
    let words = ["-E", entry, "-T", "cs_6_0", "-HV", "2018", "-no-warnings", "-Ges"];
    // Wide characters have 32 bits on Linux.
    let wide = words.map(|word| word.chars().map(|c| c as i32).chain([0]).collect::<Vec<i32>>());
    let arguments = wide.each_ref().map(Vec::as_ptr);
    let mut result: Object = null_mut();
    let (mut status, mut dxil, mut words): (i32, Object, Object) = (0, null_mut(), null_mut());
    // SAFETY: the functions have this order in dxcapi.h: `IDxcCompiler3::Compile`; `IDxcResult::GetStatus`,
    // `GetResult`, `GetErrorBuffer`. Objects are never released: there are a few dozen, and the process ends soon.
    unsafe {
        let call: Compile = std::mem::transmute((**compiler).first);
        let failed =
            call(compiler, &source, arguments.as_ptr(), arguments.len() as u32, null_mut(), &I_RESULT, &mut result);
        if failed != 0 {
            return Err(format!("it does not run ({failed:#x})"));
        }
        let functions = read(*result);
        std::mem::transmute::<usize, Get<i32>>(functions.first)(result, &mut status);
        std::mem::transmute::<usize, Get<Object>>(functions.second)(result, &mut dxil);
        std::mem::transmute::<usize, Get<Object>>(functions.third)(result, &mut words);
        if status != 0 {
            return Err(String::from_utf8_lossy(bytes(words)).trim().to_owned());
        }
        if bytes(dxil).starts_with(b"DXBC") { Ok(()) } else { Err("it returns no DXIL".to_owned()) }
    }
}

/// Returns the bytes of an `IDxcBlob`; none if it is null.
///
/// # Safety
/// The object is null or an `IDxcBlob` of version 3.7, which lives on.
unsafe fn bytes(blob: Object) -> &'static [u8] {
    if blob.is_null() {
        return &[];
    }
    // SAFETY: the functions are `IDxcBlob::GetBufferPointer` and `GetBufferSize`.
    unsafe {
        let functions = read(*blob);
        let pointer: Pointer = std::mem::transmute(functions.first);
        let size: Size = std::mem::transmute(functions.second);
        std::slice::from_raw_parts(pointer(blob), size(blob))
    }
}
