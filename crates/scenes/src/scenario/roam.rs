//! Objects that walk about their homes: the hard scenes with few pairs.
//!
//! `parked`, `stations`, `layers`, `plates`, `rods`, `static-world`, `asleep`, `tower`, `aliased`, `teleport`,
//! `sheets`, `long-rods`, `beams`, `city`.

use super::rng::{Powers, Rng, cube_root};
use super::walk::reflect;
use sapwise::Aabb;

/// Greatest step on each axis in a frame, in edges.
const STEP: f32 = 0.05;
/// Frames from one jump of `teleport` to the next.
const JUMP_FRAMES: u64 = 30;
/// Half the edge of a cube.
const HALF: f32 = 0.5;
/// Shapes of beams. Their lengths are spread evenly, so that all seeds have about the same number of pairs.
const BEAMS: usize = 240;
/// Shapes of buildings.
const BUILDINGS: usize = 240;

/// Objects of a few kinds. Each walks about its own home between walls that reflect its centre.
#[derive(Debug, Clone, Default)]
pub(super) struct Roam {
    kinds: Vec<Kind>,
    /// The kind of each object, by its place in `kinds`.
    kind_of: Vec<u8>,
    /// The home of each object.
    homes: Vec<[f32; 3]>,
    /// The place of each object relative to its home.
    offsets: Vec<[f32; 3]>,
    /// Whether all objects jump every [`JUMP_FRAMES`].
    jumps: bool,
}

/// The shape and the motion of objects.
#[derive(Debug, Clone, Copy)]
struct Kind {
    /// Half the extent on each axis.
    half: [f32; 3],
    /// Greatest distance of a centre from its home on each axis.
    walls: [f32; 3],
    /// Greatest step on each axis.
    step: f32,
}

impl Kind {
    /// Unit cubes that walk like those of `uniform`, up to `walls` from their home.
    fn cubes(walls: [f32; 3]) -> Self {
        Self { half: [HALF; 3], walls, step: STEP }
    }

    /// Boxes that stay in their home.
    fn fixed(half: [f32; 3]) -> Self {
        Self { half, walls: [0.0; 3], step: 0.0 }
    }
}

/// Half the edge of the world in which `objects` unit cubes have 0.1 pairs each: a fifth of the density of `uniform`.
fn wall(objects: usize) -> f32 {
    cube_root(5.0 * objects as f64) as f32
}

/// One object of every run, at a random place in its run.
struct Scattered {
    run: usize,
    chosen: usize,
}

impl Scattered {
    fn one_in(run: usize) -> Self {
        Self { run, chosen: 0 }
    }

    /// Whether object `k` is chosen. Call it for every object in turn.
    fn is(&mut self, k: usize, rng: &mut Rng) -> bool {
        if k.is_multiple_of(self.run) {
            self.chosen = rng.below(self.run);
        }
        k % self.run == self.chosen
    }
}

/// The point `k` of a cubic lattice about the origin with `side` points along each edge, `pitch` apart.
fn lattice(k: usize, side: usize, pitch: f32) -> [f32; 3] {
    let middle = side as f32 * 0.5;
    [k % side, k / side % side, k / side / side].map(|at| (at as f32 - middle) * pitch)
}

impl Roam {
    /// Places each object somewhere between the walls about its home. `place` returns the kind and the home of each in
    /// turn.
    fn placed(
        objects: usize,
        kinds: Vec<Kind>,
        rng: &mut Rng,
        mut place: impl FnMut(usize, &mut Rng) -> (usize, [f32; 3]),
    ) -> Self {
        let mut roam = Self {
            kinds,
            kind_of: Vec::with_capacity(objects),
            homes: Vec::with_capacity(objects),
            offsets: Vec::with_capacity(objects),
            jumps: false,
        };
        for k in 0..objects {
            let (kind, home) = place(k, rng);
            roam.kind_of.push(kind as u8);
            roam.homes.push(home);
            roam.offsets.push(rng.within(roam.kinds[kind].walls));
        }
        roam
    }

    /// Shuffles the objects, so that neighbours in the list are no neighbours in space.
    fn shuffled(mut self, rng: &mut Rng) -> Self {
        for last in (1..self.homes.len()).rev() {
            let other = rng.below(last + 1);
            self.kind_of.swap(last, other);
            self.homes.swap(last, other);
            self.offsets.swap(last, other);
        }
        self
    }

    /// One object in fifty stands ten thousand worlds away on each axis, on a lattice.
    pub(super) fn parked(objects: usize, rng: &mut Rng) -> Self {
        let wall = wall(objects);
        let kinds = vec![Kind::cubes([wall; 3]), Kind::fixed([HALF; 3])];
        let side = cube_root((objects / 50 + 1) as f64).ceil() as usize;
        let far = 10_000.0 * 2.0 * wall;
        let (mut scattered, mut parked) = (Scattered::one_in(50), 0);
        Self::placed(objects, kinds, rng, |k, rng| {
            if !scattered.is(k, rng) {
                return (0, [0.0; 3]);
            }
            parked += 1;
            (1, lattice(parked - 1, side, 4.0).map(|at| far + at))
        })
    }

    /// Half of the objects in each of two worlds, a thousand of their edges apart.
    pub(super) fn stations(objects: usize, rng: &mut Rng) -> Self {
        let wall = wall(objects.div_ceil(2));
        // Half of 1000 edges of 2 walls, along the diagonal of a cube.
        let away = 1000.0 * wall / 3.0_f32.sqrt();
        let mut scattered = Scattered::one_in(2);
        let place = |k: usize, rng: &mut Rng| (0, [if scattered.is(k, rng) { away } else { -away }; 3]);
        Self::placed(objects, vec![Kind::cubes([wall; 3])], rng, place)
    }

    /// Floors of n^(1/4) by n^(1/4) flat objects, each in a field of its own.
    pub(super) fn layers(objects: usize, rng: &mut Rng) -> Self {
        let side = (objects as f64).sqrt().sqrt().ceil().max(1.0) as usize;
        let thickness = 0.1;
        let half = [HALF, HALF, 0.5 * thickness];
        // Fields are 1.25 wide and floors 0.25 apart: a twentieth stays free at least on x and y, a fiftieth on z.
        let flat = Kind { half, walls: [0.1, 0.1, 0.065], step: STEP * thickness };
        let floors = objects.div_ceil(side * side);
        let place = |k: usize, _: &mut Rng| {
            let [x, y, floor] = [k % side, k / side % side, k / side / side];
            (0, [(x as f32) * 1.25, (y as f32) * 1.25, (floor as f32 - floors as f32 * 0.5) * 0.25])
        };
        Self::placed(objects, vec![flat], rng, place).shuffled(rng)
    }

    /// Up to eight packs of plates as wide as the world, one object in 33, and cubes in the storeys between the
    /// packs.
    pub(super) fn plates(objects: usize, rng: &mut Rng) -> Self {
        let wall = wall(objects);
        let plates = objects / 33 + 1;
        let packs = plates.min(8);
        // Storeys add up to the world's edge, and so do the packs, whatever the number of plates.
        let storey = 2.0 * wall / packs as f32;
        let in_pack = plates.div_ceil(packs);
        let pitch = storey / in_pack as f32;
        // Cubes reach a tenth of an edge into the packs, and plates leave a quarter of the pitch free.
        let cubes = Kind::cubes([wall, wall, (0.5 * storey - HALF + 0.1).max(0.0)]);
        let plate =
            Kind { half: [wall + 1.0, wall + 1.0, 0.25 * pitch], walls: [0.125 * pitch; 3], step: STEP * 0.5 * pitch };
        let bottom = |level: usize| (2.0 * level as f32 - packs as f32) * storey;
        let (mut scattered, mut placed) = (Scattered::one_in(33), 0);
        Self::placed(objects, vec![cubes, plate], rng, |k, rng| {
            if !scattered.is(k, rng) {
                return (0, [0.0, 0.0, bottom(rng.below(packs)) + 0.5 * storey]);
            }
            let (pack, at) = (placed / in_pack, (placed % in_pack) as f32 + 0.5);
            placed += 1;
            (1, [0.0, 0.0, bottom(pack) + storey + at * pitch])
        })
    }

    /// One object in ten is a rod along a random axis.
    pub(super) fn rods(objects: usize, rng: &mut Rng) -> Self {
        // The mean volume in which two of these objects overlap is 42, not 8: 0.1 pairs need a world of 212 per
        // object.
        let wall = (cube_root(212.0 * objects as f64) * 0.5) as f32;
        let mut kinds = vec![Kind::cubes([wall; 3]); 4];
        (0..3).for_each(|axis| kinds[axis].half[axis] = 15.0);
        let mut scattered = Scattered::one_in(10);
        let place = |k: usize, rng: &mut Rng| (if scattered.is(k, rng) { rng.below(3) } else { 3 }, [0.0; 3]);
        Self::placed(objects, kinds, rng, place)
    }

    /// A hilly ground of fixed boxes that overlap their 24 neighbours, and one object in twenty that moves above and
    /// in it.
    pub(super) fn static_world(objects: usize, rng: &mut Rng) -> Self {
        let side = (objects as f64).sqrt().ceil() as usize;
        let wall = side as f32 * 0.5;
        let kinds = vec![Kind::fixed([1.1, 1.1, 1.0]), Kind::cubes([wall, wall, 5.0])];
        // Up and down by 2 within 20 edges: neighbours differ by at most 0.4, less than a box is high.
        let hill = |at: usize| (at % 20).abs_diff(10) as f32 * 0.2 - 1.0;
        let mut scattered = Scattered::one_in(20);
        let place = |k: usize, rng: &mut Rng| {
            let (x, y) = (k % side, k / side);
            let ground = [x as f32 - wall, y as f32 - wall, hill(x) + hill(y)];
            if scattered.is(k, rng) { (1, [0.0, 0.0, 5.0]) } else { (0, ground) }
        };
        Self::placed(objects, kinds, rng, place).shuffled(rng)
    }

    /// One object in fifty lies four million edges below the others and stays there.
    pub(super) fn asleep(objects: usize, rng: &mut Rng) -> Self {
        let wall = wall(objects);
        let cubes = Kind::cubes([wall; 3]);
        let mut scattered = Scattered::one_in(50);
        Self::placed(objects, vec![cubes, Kind::fixed([HALF; 3])], rng, |k, rng| {
            if !scattered.is(k, rng) {
                return (0, [0.0; 3]);
            }
            let [x, y, z] = rng.within(cubes.walls);
            (1, [x, y - 4.0e6, z])
        })
    }

    /// Unit cubes on one line, each overlapping those above and below it.
    pub(super) fn tower(objects: usize, rng: &mut Rng) -> Self {
        let place = |k: usize, _: &mut Rng| (0, [0.0, 0.0, (k as f32 - objects as f32 * 0.5) * 0.75]);
        Self::placed(objects, vec![Kind::cubes([0.1; 3])], rng, place).shuffled(rng)
    }

    /// Boxes far apart in the middle of each of 256 equal parts of the list: those that an evenly spaced sample takes.
    pub(super) fn aliased(objects: usize, rng: &mut Rng) -> Self {
        let wall = wall(objects);
        // A power of two: for 2^17 objects the special ones have the indices 256 modulo 512.
        let parts = 1 << (objects as u64 / 32).max(1).ilog2().min(8);
        let mut part = 0;
        Self::placed(objects, vec![Kind::cubes([wall; 3])], rng, |k, rng| {
            let special = (2 * part + 1) * objects as u64 / (2 * parts) == k as u64;
            part += u64::from(special);
            (0, if special { rng.signed3().map(|u| u * 1000.0 * wall) } else { [0.0; 3] })
        })
    }

    /// Unit cubes that walk and now and then all jump to new places.
    pub(super) fn teleport(objects: usize, rng: &mut Rng) -> Self {
        let walking = Self::placed(objects, vec![Kind::cubes([wall(objects); 3])], rng, |_, _| (0, [0.0; 3]));
        Self { jumps: true, ..walking }
    }

    /// Sheets as wide as the world at random heights.
    pub(super) fn sheets(objects: usize, rng: &mut Rng) -> Self {
        let wall = cube_root(objects as f64) as f32;
        let gap = 2.0 * wall / objects.max(1) as f32;
        // Pairs per object equal the mean thickness in gaps: 0.1.
        let sheet = |thickness: f32| Kind {
            half: [wall, wall, 0.5 * thickness * gap],
            walls: [0.0, 0.0, wall],
            step: 0.25 * gap,
        };
        Self::placed(objects, vec![sheet(0.0), sheet(0.2)], rng, |k, _| (k % 2, [0.0; 3]))
    }

    /// Rods as long as the world, each along a random axis.
    pub(super) fn long_rods(objects: usize, rng: &mut Rng) -> Self {
        let wall = cube_root(objects as f64) as f32;
        // Rods of two axes pass each other on the third: with a thickness of t world edges, n rods have 2 n^2 t / 3
        // pairs, 0.75 per object.
        let half = 1.125 * wall / objects.max(1) as f32;
        let rod = |along: usize| {
            let of = |own: f32, other: f32| [0, 1, 2].map(|axis| if axis == along { own } else { other });
            Kind { half: of(wall, half), walls: of(0.0, wall), step: 0.5 * half }
        };
        Self::placed(objects, [0, 1, 2].map(rod).into(), rng, |_, rng| (rng.below(3), [0.0; 3]))
    }

    /// One object in ten has the bounds of a beam in a random direction.
    pub(super) fn beams(objects: usize, rng: &mut Rng) -> Self {
        // The mean volume in which two of these objects overlap is 1470: 0.3 pairs, and fewer at the walls, need a
        // world of 2450 per object.
        let wall = (cube_root(2450.0 * objects as f64) * 0.5) as f32;
        let lengths = Powers::new(100.0);
        let beam = |k: usize| {
            let along = rng.gauss3();
            let norm = along.iter().map(|a| a * a).sum::<f32>().sqrt();
            let length = lengths.of((k as f32 + 0.5) / BEAMS as f32) as f32;
            Kind { half: along.map(|a| 0.5 * length * a.abs() / norm + 0.1), ..Kind::cubes([wall; 3]) }
        };
        let mut kinds: Vec<Kind> = (0..BEAMS).map(beam).collect();
        kinds.push(Kind::cubes([wall; 3]));
        let mut scattered = Scattered::one_in(10);
        let place = |k: usize, rng: &mut Rng| (if scattered.is(k, rng) { rng.below(BEAMS) } else { BEAMS }, [0.0; 3]);
        Self::placed(objects, kinds, rng, place)
    }

    /// Fixed buildings on a lattice, and up to 2000 objects that move between and in them.
    pub(super) fn city(objects: usize, rng: &mut Rng) -> Self {
        let movers = (objects / 20).min(2000);
        let side = ((objects - movers) as f64).sqrt().ceil() as usize;
        let wall = side as f32;
        let building = |_| {
            let [x, y, z] = [(); 3].map(|()| rng.unit());
            Kind::fixed([0.6 + 0.7 * x, 0.6 + 0.7 * y, 0.5 + 9.5 * z])
        };
        let mut kinds: Vec<Kind> = (0..BUILDINGS).map(building).collect();
        kinds.push(Kind::cubes([wall, wall, 10.0]));
        let heights: Vec<f32> = kinds.iter().map(|kind| kind.half[2]).collect();
        let place = |k: usize, rng: &mut Rng| {
            if k >= objects - movers {
                return (BUILDINGS, [0.0, 0.0, 10.0]);
            }
            let kind = rng.below(BUILDINGS);
            let [x, y] = [k % side, k / side].map(|at| 2.0 * at as f32 - wall);
            (kind, [x, y, heights[kind]])
        };
        Self::placed(objects, kinds, rng, place).shuffled(rng)
    }

    /// Writes the boxes of all objects.
    pub(super) fn place(&self, boxes: &mut Vec<Aabb>) {
        boxes.clear();
        let objects = self.kind_of.iter().zip(&self.homes).zip(&self.offsets);
        boxes.extend(objects.map(|((&kind, home), offset)| self.kinds[usize::from(kind)].aabb(home, offset)));
    }

    /// Steps into `frame` and rewrites the boxes of the objects that moved.
    pub(super) fn advance(&mut self, frame: u64, rng: &mut Rng, boxes: &mut [Aabb]) {
        let jump = self.jumps && frame.is_multiple_of(JUMP_FRAMES);
        let objects = self.kind_of.iter().zip(&self.homes).zip(&mut self.offsets).zip(boxes);
        for (((&kind, home), offset), aabb) in objects {
            let kind = &self.kinds[usize::from(kind)];
            if kind.step == 0.0 {
                continue;
            }
            if jump {
                *offset = rng.within(kind.walls);
            } else {
                let step = rng.signed3();
                for a in 0..3 {
                    offset[a] = reflect(offset[a] + step[a] * kind.step, kind.walls[a]);
                }
            }
            *aabb = kind.aabb(home, offset);
        }
    }

    /// Whether the object with this index never moves.
    pub(super) fn is_fixed(&self, index: usize) -> bool {
        self.kind_of.get(index).is_some_and(|&kind| self.kinds[usize::from(kind)].step == 0.0)
    }
}

impl Kind {
    #[inline]
    fn aabb(&self, home: &[f32; 3], offset: &[f32; 3]) -> Aabb {
        let centre = [0, 1, 2].map(|a| home[a] + offset[a]);
        Aabb::new([0, 1, 2].map(|a| centre[a] - self.half[a]), [0, 1, 2].map(|a| centre[a] + self.half[a]))
    }
}
