//! Pairs found on WebGPU.

use crate::arrays::{boxes, pairs};
use crate::fault::{call, error};
use js_sys::{Float32Array, Promise, Uint32Array};
use sapwise::algorithm::Entry;
use sapwise::{Aabb, Pairs};
use sapwise_gpu::{AsyncBroadPhase, Gpu, GpuIdentity, GpuKind};
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::future_to_promise;

/// The GPU that the browser gives a page or worker, through WebGPU.
#[wasm_bindgen(js_name = Gpu)]
pub struct WebGpu(pub(crate) Gpu);

#[wasm_bindgen(js_class = Gpu)]
impl WebGpu {
    /// Opens it. Rejects if the browser has no WebGPU or refuses it.
    pub async fn open() -> Result<Self, JsError> {
        if !crate::probe::told("navigator", "gpu").is_some_and(|gpu| gpu.is_object()) {
            return error("this browser has no WebGPU");
        }
        Ok(Self(Gpu::in_browser().await?))
    }

    /// Returns the algorithms that run on a GPU, as "bvh@gpu0".
    pub fn algorithms() -> Vec<String> {
        entries().map(|entry| entry.id.to_string()).collect()
    }

    /// Returns whether the CPU plays the GPU.
    #[wasm_bindgen(getter)]
    pub fn software(&self) -> bool {
        self.0.identity().kind == GpuKind::Software
    }

    /// Makes a broad phase that runs one of `algorithms()`. Rejects if the GPU refuses it.
    #[wasm_bindgen(js_name = broadPhase)]
    pub async fn broad_phase(&self, algorithm: String) -> Result<GpuBroadPhase, JsError> {
        let Some(entry) = entries().find(|entry| entry.id.to_string() == algorithm) else {
            return error(format!("no algorithm {algorithm}; use {}", Self::algorithms().join(", ")));
        };
        let search = AsyncBroadPhase::new(&self.0, entry.id.method()).await?;
        Ok(GpuBroadPhase(Rc::new(RefCell::new(Some(Frames { search, boxes: Vec::new(), pairs: Pairs::new() })))))
    }
}

/// Returns the algorithms on a GPU. Brute force would stop a page's picture for seconds.
pub(crate) fn entries() -> impl Iterator<Item = Entry> {
    let gpu = GpuIdentity::new(0, "", GpuKind::Other);
    sapwise_gpu::algorithms([&gpu]).into_iter().filter(|entry| entry.id.method() != "brute")
}

/// Finds the overlapping pairs of frames on WebGPU.
#[wasm_bindgen]
pub struct GpuBroadPhase(Rc<RefCell<Option<Frames>>>);

struct Frames {
    search: AsyncBroadPhase,
    boxes: Vec<Aabb>,
    pairs: Pairs,
}

#[wasm_bindgen]
impl GpuBroadPhase {
    /// Finds the pairs of the next frame, as `BroadPhase.update` does. Throws while the frame before is on its way.
    #[wasm_bindgen(unchecked_return_type = "Promise<Uint32Array>")]
    pub fn update(&self, array: &Float32Array) -> Result<Promise, JsError> {
        call(|| {
            let Some(mut frames) = self.0.take() else {
                return error("the frame before is still on its way: await it");
            };
            let copied = boxes(array, &mut frames.boxes);
            let home = Rc::clone(&self.0);
            if let Err(error) = copied {
                home.replace(Some(frames));
                return Err(error);
            }
            Ok(future_to_promise(async move {
                let Frames { search, boxes, pairs: found } = &mut frames;
                let result = search.find_pairs(boxes, found).await;
                let answer = result.map(|()| pairs(found.as_slice())).map_err(|error| JsError::from(error).into());
                home.replace(Some(frames));
                answer.map(|pairs: Uint32Array| pairs.into())
            }))
        })
    }
}
