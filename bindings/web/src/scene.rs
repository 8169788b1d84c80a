//! Scenes of moving boxes, which can be split and deleted.

use crate::arrays::view;
use crate::fault::{call, error};
use js_sys::Float32Array;
use sapwise::Aabb;
use sapwise_scenes::Scenario;
use std::cell::RefCell;
use wasm_bindgen::prelude::*;

/// Most objects, whose memory a browser gives.
const MOST_OBJECTS: u32 = 2_000_000;

/// Speed of a piece away from the middle of what was split on each axis, in its own half edges per frame, and the
/// share of it that is left after a frame: pieces come to rest about two edges away.
const SPEED: f32 = 0.2;
const KEPT: f32 = 0.95;

/// Returns the names of all scenarios.
#[wasm_bindgen]
pub fn scenarios() -> Vec<String> {
    Scenario::ALL.iter().map(ToString::to_string).collect()
}

/// A scene of moving boxes, the same on every machine. Boxes can be split and deleted, as in Figure 1 of Avril,
/// Gouranton and Arnaldi (ISVRI 2011).
#[wasm_bindgen(js_name = Scene)]
pub struct WebScene(RefCell<Pieces>);

struct Pieces {
    scene: sapwise_scenes::Scene,
    seed: u64,
    pieces: Vec<Piece>,
    /// Objects of the scene that have had a piece.
    known: usize,
    boxes: Vec<Aabb>,
}

/// An object of the scene, or what splits have left of it.
#[derive(Clone, Copy)]
struct Piece {
    object: u32,
    /// Its edges over those of the object.
    share: f32,
    /// From the middle of the object.
    offset: [f32; 3],
    velocity: [f32; 3],
}

impl Piece {
    fn whole(object: usize) -> Self {
        Self { object: object as u32, share: 1.0, offset: [0.0; 3], velocity: [0.0; 3] }
    }

    fn aabb(&self, of: &Aabb) -> Aabb {
        if self.share == 1.0 {
            return *of;
        }
        let half = [0, 1, 2].map(|a| (of.max[a] - of.min[a]) * 0.5 * self.share);
        let middle = [0, 1, 2].map(|a| (of.min[a] + of.max[a]) * 0.5 + self.offset[a]);
        Aabb::new([0, 1, 2].map(|a| middle[a] - half[a]), [0, 1, 2].map(|a| middle[a] + half[a]))
    }
}

impl Pieces {
    fn start(scenario: Scenario, objects: f64, seed: u64) -> Result<Self, JsError> {
        if !(objects.fract() == 0.0 && (0.0..=f64::from(MOST_OBJECTS)).contains(&objects)) {
            return error(format!("objects is {objects}; give a whole number from 0 to {MOST_OBJECTS}"));
        }
        let scene = scenario.start(objects as usize, seed);
        let mut pieces = Self { scene, seed, pieces: Vec::new(), known: 0, boxes: Vec::new() };
        pieces.place();
        Ok(pieces)
    }

    /// Writes the boxes of this frame.
    fn place(&mut self) {
        let objects = self.scene.boxes();
        if objects.len() < self.known {
            self.pieces.retain(|piece| (piece.object as usize) < objects.len());
        }
        self.pieces.extend((self.known..objects.len()).map(Piece::whole));
        self.known = objects.len();
        self.boxes.clear();
        self.boxes.extend(self.pieces.iter().map(|piece| piece.aabb(&objects[piece.object as usize])));
    }

    fn check(&self, index: usize) -> Result<usize, JsError> {
        if index < self.pieces.len() {
            return Ok(index);
        }
        error(format!("there is no box {index}: the scene has {}", self.pieces.len()))
    }
}

#[wasm_bindgen(js_class = Scene)]
impl WebScene {
    /// Starts a scene of `objects` boxes. `scenarios()` lists the scenarios. "fragmentation" begins with ten boxes,
    /// and `objects` is its peak. The same seed gives the same boxes.
    #[wasm_bindgen(constructor)]
    pub fn new(scenario: &str, objects: f64, seed: f64) -> Result<Self, JsError> {
        call(|| Ok(Self(RefCell::new(Pieces::start(scenario.parse()?, objects, seed as u64)?))))
    }

    /// Goes on to the next frame.
    pub fn step(&self) -> Result<(), JsError> {
        call(|| {
            let this = &mut *self.0.borrow_mut();
            this.scene.advance();
            for piece in this.pieces.iter_mut().filter(|piece| piece.share < 1.0) {
                for (offset, velocity) in piece.offset.iter_mut().zip(&mut piece.velocity) {
                    *offset += *velocity;
                    *velocity *= KEPT;
                }
            }
            this.place();
            Ok(())
        })
    }

    /// Returns the number of boxes.
    #[wasm_bindgen(getter)]
    pub fn length(&self) -> usize {
        self.0.borrow().boxes.len()
    }

    /// Returns the boxes of this frame: six numbers for each, as in `findPairs`. It is a view of the memory of this
    /// module: use or copy it before the next call of any function.
    pub fn boxes(&self) -> Float32Array {
        view(&self.0.borrow().boxes)
    }

    /// Splits a box into eight, which fly apart. The first takes its place, the others come to the end.
    pub fn split(&self, index: usize) -> Result<(), JsError> {
        call(|| {
            let this = &mut *self.0.borrow_mut();
            let index = this.check(index)?;
            let whole = this.pieces[index];
            let half = [0, 1, 2].map(|a| (this.boxes[index].max[a] - this.boxes[index].min[a]) * 0.5);
            for corner in 0..8 {
                let mut piece = Piece { share: whole.share * 0.5, ..whole };
                for a in 0..3 {
                    let side = if corner >> a & 1 == 1 { 1.0 } else { -1.0 };
                    piece.offset[a] += side * half[a] * 0.5;
                    piece.velocity[a] += side * half[a] * 0.5 * SPEED;
                }
                if corner == 0 {
                    this.pieces[index] = piece;
                } else {
                    this.pieces.push(piece);
                }
            }
            this.place();
            Ok(())
        })
    }

    /// Deletes a box. The last box takes its place.
    pub fn remove(&self, index: usize) -> Result<(), JsError> {
        call(|| {
            let this = &mut *self.0.borrow_mut();
            let index = this.check(index)?;
            this.pieces.swap_remove(index);
            this.place();
            Ok(())
        })
    }

    /// Starts the scene again with another number of objects: the world is larger with more of them.
    pub fn resize(&self, objects: f64) -> Result<(), JsError> {
        call(|| {
            let this = &mut *self.0.borrow_mut();
            *this = Pieces::start(this.scene.scenario(), objects, this.seed)?;
            Ok(())
        })
    }
}
