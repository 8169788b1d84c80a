//! Scenes for the unit tests.
//!
//! `sapwise-scenes` depends on the normal build of this library, whose `Aabb` is another type than that of the library
//! under test.

use crate::Aabb;
pub(crate) use sapwise_scenes::Scenario;

/// A scene with the box type of the library under test.
pub(crate) struct Scene {
    scene: sapwise_scenes::Scene,
    boxes: Vec<Aabb>,
}

impl Scene {
    pub(crate) fn start(scenario: Scenario, objects: usize, seed: u64) -> Self {
        let mut scene = Self { scene: scenario.start(objects, seed), boxes: Vec::new() };
        scene.convert();
        scene
    }

    pub(crate) fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }

    pub(crate) fn advance(&mut self) {
        self.scene.advance();
        self.convert();
    }

    fn convert(&mut self) {
        self.boxes.clear();
        self.boxes.extend(self.scene.boxes().iter().map(|b| Aabb::new(b.min, b.max)));
    }
}
