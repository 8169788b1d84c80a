//! Two spaces and a list of bodies, on which the same random calls are made. The double loop over the list is the
//! definition of what the spaces must return.

use sapwise::error::{BoxDefect, RayDefect};
use sapwise::{Aabb, Body, Error, Handle, Ray, Space};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Debug;

const INF: f32 = f32::INFINITY;

/// Most bodies: enough for some to rest.
const MOST: usize = if cfg!(miri) { 80 } else { 300 };

/// Most pairs of boxes that the double loop tests in one run.
const MOST_TESTS: usize = 3_000_000;

/// The bytes that decide the calls; zeros follow the last one.
struct Source<'a>(&'a [u8]);

impl Source<'_> {
    fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    fn below(&mut self, end: usize) -> usize {
        usize::from(self.byte()) % end
    }

    /// Returns a number that others are often equal to.
    fn lattice(&mut self, world: u8) -> f32 {
        f32::from(self.byte() % world) * 0.5
    }

    fn point(&mut self, world: u8) -> [f32; 3] {
        let mut point = [0; 3].map(|_| self.lattice(world));
        match self.below(32) {
            0 => point[self.below(3)] = [f32::NAN, INF, -INF, f32::MAX][self.below(4)],
            1 => point = point.map(|v| v * 0.77 - 1.0),
            _ => {}
        }
        point
    }

    fn direction(&mut self) -> [f32; 3] {
        let mut direction = [0; 3].map(|_| f32::from(self.byte() % 8) * 0.5 - 1.5);
        if self.below(32) == 0 {
            direction[self.below(3)] = [f32::NAN, -INF, 1.0e-40, 0.3][self.below(4)];
        }
        direction
    }

    fn aabb(&mut self, world: u8) -> Aabb {
        let min = [0; 3].map(|_| self.lattice(world));
        let max = min.map(|v| v + self.lattice(4));
        let mut b = Aabb::new(min, max);
        let (kind, axis) = (self.below(64), self.below(3));
        match kind {
            0 => b = Aabb::new([-INF; 3], [INF; 3]),
            1 => b.max[axis] = INF,
            2 => b.min[axis] = -INF,
            3 => (b.min[axis], b.max[axis]) = (INF, INF),
            4 => (b.min[axis], b.max[axis]) = (b.min[axis] - 1.0e6, b.max[axis] - 1.0e6),
            5 => b.max[axis] = f32::MAX,
            6..10 => b.max = b.min,
            10 => b.min[axis] = f32::NAN,
            11 => b.min[axis] = b.max[axis] + 1.0,
            12 => b = Aabb::new(b.min.map(|v| v * 0.77), b.max.map(|v| v * 0.77)),
            _ => {}
        }
        b
    }

    fn body(&mut self) -> Body {
        let body = match self.below(8) {
            0 | 1 => Body::fixed(),
            2 => Body::kinematic(),
            3 => Body::default().owner(self.byte().into()),
            4 => Body::default().groups(1 << self.below(3)).masks(self.byte().into()),
            _ => return Body::default(),
        };
        body.user_data(self.byte().into())
    }
}

fn defect(b: &Aabb) -> Option<BoxDefect> {
    let nan = b.min.iter().chain(&b.max).any(|v| v.is_nan());
    let inverted = (0..3).any(|a| b.min[a] > b.max[a]);
    if nan { Some(BoxDefect::NotANumber) } else { inverted.then_some(BoxDefect::Inverted) }
}

/// Returns the error for the first invalid box.
fn check_boxes(boxes: &[Aabb]) -> Result<(), Error> {
    let first = boxes.iter().enumerate().find_map(|(index, b)| Some((index, defect(b)?)));
    first.map_or(Ok(()), |(index, defect)| Err(Error::InvalidBox { index, defect }))
}

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    // Without branches: a fuzzer would try to cover each.
    (0..3).fold(true, |meet, k| meet & (a.min[k] <= b.max[k]) & (b.min[k] <= a.max[k]))
}

fn wanted(a: &Body, b: &Body) -> bool {
    let (a, b) = (a.membership(), b.membership());
    let apart = a.owner == 0 || a.owner != b.owner;
    a.groups & b.mask != 0 && b.groups & a.mask != 0 && !(a.fixed && b.fixed) && apart
}

/// Returns when a box that moves meets another one.
fn meeting(one: &Aabb, motion: [f32; 3], max: f32, other: &Aabb) -> Option<f32> {
    let (mut enter, mut leave) = (0.0_f32, max.min(f32::MAX));
    for (a, inverse) in motion.map(f32::recip).into_iter().enumerate() {
        let times = [(other.min[a] - one.max[a]) * inverse, (other.max[a] - one.min[a]) * inverse];
        let [near, far] = if inverse < 0.0 { [times[1], times[0]] } else { times };
        // NaN is no limit.
        (enter, leave) = (enter.max(near), leave.min(far));
    }
    (enter <= leave).then_some(enter)
}

fn slot(handle: &Handle) -> u64 {
    handle.to_bits() >> 32
}

fn distance(point: [f32; 3], b: &Aabb) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|a| (b.min[a] - point[a]).max(point[a] - b.max[a]).max(0.0));
    (x * x + y * y + z * z).sqrt()
}

/// The list.
#[derive(Clone, Default)]
struct Model {
    bodies: BTreeMap<Handle, (Aabb, Body)>,
    /// All handles that there ever were.
    given: BTreeSet<Handle>,
    /// The slots of bodies that were removed since the last update: no other body gets them before the next one.
    removed: BTreeSet<u64>,
    /// The most bodies at once. Removed ones count until the next update. No slot reaches this number.
    most: usize,
    /// Boxes at the last update.
    seen: BTreeMap<Handle, Aabb>,
    pairs: Vec<(Handle, Handle)>,
    begun: Vec<(Handle, Handle)>,
    ended: Vec<(Handle, Handle)>,
}

impl Model {
    fn find(&self, handle: Handle) -> Result<(), Error> {
        self.bodies.get(&handle).map(drop).ok_or(Error::StaleHandle { handle })
    }

    fn check(&self, handle: Handle, b: &Aabb) -> Result<(), Error> {
        self.find(handle)?;
        defect(b).map_or(Ok(()), |defect| Err(Error::InvalidBody { handle, defect }))
    }

    /// Returns whether a body has another box than at the last update, or had none. It is active in the next one.
    fn has_moved(&self, handle: &Handle) -> bool {
        self.seen.get(handle) != self.bodies.get(handle).map(|(b, _)| b)
    }

    fn update(&mut self) {
        let all: Vec<_> = self.bodies.iter().collect();
        let mut pairs = Vec::new();
        for (k, (one, (a, body))) in all.iter().enumerate() {
            let meet = all[k + 1..].iter().filter(|(_, (b, other))| overlap(a, b) && wanted(body, other));
            pairs.extend(meet.map(|(other, _)| (**one, **other)));
        }
        type Pair = (Handle, Handle);
        let without = |all: &[Pair], others: &[Pair]| -> Vec<Pair> {
            all.iter().filter(|pair| others.binary_search(pair).is_err()).copied().collect()
        };
        self.begun = without(&pairs, &self.pairs);
        self.ended = without(&self.pairs, &pairs);
        self.pairs = pairs;
        self.removed.clear();
        self.seen = self.bodies.iter().map(|(&handle, &(b, _))| (handle, b)).collect();
    }
}

struct Run<'a> {
    source: Source<'a>,
    world: u8,
    spaces: [Space; 2],
    model: Model,
    saved: (Space, Model),
    tests: usize,
}

/// Makes the calls that these bytes stand for. `restored` returns a space that must go on as the given one.
///
/// # Panics
/// A space returns something wrong.
pub(crate) fn run(bytes: &[u8], spaces: [Space; 2], restored: impl Fn(&Space) -> Space) {
    let mut source = Source(bytes);
    let world = [3, 8, 20, 60][source.below(4)];
    let saved = (spaces[0].clone(), Model::default());
    let mut run = Run { source, world, spaces, model: Model::default(), saved, tests: 0 };
    while !run.source.0.is_empty() && run.tests < MOST_TESTS {
        run.call(&restored);
    }
    run.update();
}

impl Run<'_> {
    fn call(&mut self, restored: impl Fn(&Space) -> Space) {
        match self.source.below(32) {
            0 => self.insert(1),
            1 | 2 => {
                let count = self.source.below(200);
                self.insert(count);
            }
            3..8 => self.set(1),
            8 | 9 => {
                let count = self.source.below(12);
                self.set(count);
            }
            10 => self.shift(),
            11 | 12 => self.set_body(),
            13 | 14 => self.remove(1),
            15 => {
                let count = self.source.below(6);
                self.remove(count);
            }
            16..20 => self.update(),
            20..23 => (0..self.source.below(16)).for_each(|_| self.update()),
            23 => self.update_within_limit(),
            24 => self.spaces[1] = self.spaces[0].clone(),
            25 | 26 => self.spaces[1] = restored(&self.spaces[0]),
            27 => {
                let [one, other] = &mut self.spaces;
                other.clone_from(one);
            }
            28 => self.saved = (self.spaces[1].clone(), self.model.clone()),
            29 => {
                self.spaces.iter_mut().for_each(|space| space.clone_from(&self.saved.0));
                self.model = self.saved.1.clone();
            }
            _ => self.query(),
        }
        self.compare();
    }

    /// Makes a call on both spaces, which must return the same.
    fn both<T: PartialEq + Debug>(&mut self, call: impl Fn(&mut Space) -> T) -> T {
        let [one, other] = self.spaces.each_mut().map(call);
        assert_eq!(one, other, "the spaces differ");
        one
    }

    /// Returns a handle: usually of a body, at times a stale or a foreign one.
    fn handle(&mut self) -> Handle {
        let handles: Vec<Handle> = match self.source.below(24) {
            0 => self.model.given.iter().copied().collect(),
            1 => vec![Handle::from_bits(1 + u64::from(self.source.byte()) * 0x1_8000_0001).unwrap()],
            _ => self.model.bodies.keys().copied().collect(),
        };
        let at = usize::from(self.source.byte()) * 256 + usize::from(self.source.byte());
        handles.get(at % handles.len().max(1)).copied().unwrap_or(Handle::from_bits(u64::MAX).unwrap())
    }

    fn insert(&mut self, count: usize) {
        let (body, count) = (self.source.body(), count.min(MOST - self.model.bodies.len()));
        let boxes: Vec<Aabb> = (0..count).map(|_| self.source.aabb(self.world)).collect();
        let given = self.both(|space| match boxes[..] {
            [b] => space.insert(b, body).map(|handle| vec![handle]),
            _ => space.insert_all(&boxes, body),
        });
        assert_eq!(given.as_ref().map(drop), check_boxes(&boxes).as_ref().map(drop));
        for (handle, b) in given.into_iter().flatten().zip(boxes) {
            assert!(self.model.given.insert(handle), "{handle} was given twice");
            self.model.bodies.insert(handle, (b, body));
            let (slot, removed) = (slot(&handle), &self.model.removed);
            self.model.most = self.model.most.max(self.model.bodies.len() + removed.len());
            assert!(!removed.contains(&slot), "slot {slot} was used again before an update");
        }
        let highest = self.model.bodies.keys().map(slot).max();
        assert!(highest.is_none_or(|slot| slot < self.model.most as u64), "{highest:?}, not below {}", self.model.most);
    }

    fn set(&mut self, count: usize) {
        let handles: Vec<Handle> = (0..count).map(|_| self.handle()).collect();
        let boxes: Vec<Aabb> = (0..count).map(|_| self.source.aabb(self.world)).collect();
        self.set_all(&handles, &boxes);
    }

    /// Moves most bodies.
    fn shift(&mut self) {
        let (by, every) = (self.source.lattice(5) - 1.0, self.source.below(8));
        let moved = self.model.bodies.iter().enumerate().filter(|(k, _)| k % 8 <= every);
        let (handles, boxes): (Vec<Handle>, Vec<Aabb>) = moved
            .map(|(_, (&handle, (b, _)))| (handle, Aabb::new(b.min.map(|v| v + by), b.max.map(|v| v + by))))
            .unzip();
        self.set_all(&handles, &boxes);
    }

    fn set_all(&mut self, handles: &[Handle], boxes: &[Aabb]) {
        let expected = handles.iter().zip(boxes).try_for_each(|(&handle, b)| self.model.check(handle, b));
        let found = self.both(|space| match (handles, boxes) {
            (&[handle], &[b]) => space.set(handle, b),
            _ => space.set_all(handles, boxes),
        });
        assert_eq!(found, expected);
        if found.is_ok() {
            for (handle, &b) in handles.iter().zip(boxes) {
                self.model.bodies.get_mut(handle).unwrap().0 = b;
            }
        }
    }

    fn set_body(&mut self) {
        let (handle, body) = (self.handle(), self.source.body());
        assert_eq!(self.both(|space| space.set_body(handle, body)), self.model.find(handle));
        self.model.bodies.entry(handle).and_modify(|(_, known)| *known = body);
    }

    fn remove(&mut self, count: usize) {
        let mut handles: Vec<Handle> = (0..count).map(|_| self.handle()).collect();
        if count > 3 {
            handles[0] = handles[3];
        }
        let expected = handles.iter().try_for_each(|&handle| self.model.find(handle));
        let found = self.both(|space| match handles[..] {
            [handle] => space.remove(handle),
            _ => space.remove_all(&handles),
        });
        assert_eq!(found, expected);
        if found.is_ok() {
            self.model.bodies.retain(|handle, _| !handles.contains(handle));
            self.model.removed.extend(handles.iter().map(slot));
        }
    }

    fn update(&mut self) {
        self.tests += self.model.bodies.len().pow(2) + self.model.pairs.len();
        self.both(|space| space.update()).unwrap();
        self.model.update();
        self.compare();
    }

    /// Removes some bodies and makes an update that fails if active bodies have more pairs, and if so some calls and
    /// another update.
    fn update_within_limit(&mut self) {
        let (limit, count) = ([0, 3, 40][self.source.below(3)], self.source.below(3));
        self.remove(count);
        self.both(|space| space.set_limit(Some(limit)));
        let found = self.both(|space| space.update());
        self.both(|space| space.set_limit(None));
        self.tests += self.model.bodies.len().pow(2);
        let mut after = self.model.clone();
        after.update();
        if found.is_ok() {
            let surely_active =
                after.pairs.iter().filter(|(a, b)| self.model.has_moved(a) && self.model.has_moved(b)).count();
            assert!(surely_active <= limit, "{surely_active} pairs of active bodies, more than {limit}");
            self.model = after;
            return;
        }
        assert_eq!(found, Err(Error::TooManyPairs { limit }));
        assert!(after.pairs.len() > limit, "no more than {limit} pairs: {}", after.pairs.len());
        assert!(self.spaces.iter().all(|space| space.begun().is_empty() && space.ended().is_empty()));
        match self.source.below(4) {
            0 | 1 => self.shift(),
            2 => self.remove(2),
            _ => self.insert(5),
        }
        self.update();
        self.insert(2);
    }

    /// Compares all that the spaces return without a search.
    fn compare(&mut self) {
        let (Self { model, .. }, [space, other]) = (&*self, &self.spaces);
        assert!(space.pairs() == other.pairs(), "the order of pairs differs");
        let mut pairs = space.pairs().to_vec();
        pairs.sort_unstable();
        assert!(pairs == model.pairs, "{} pairs, not {}", pairs.len(), model.pairs.len());
        for space in &self.spaces {
            assert!(space.begun() == model.begun, "begun: {}, not {}", space.begun().len(), model.begun.len());
            assert!(space.ended() == model.ended, "ended: {}, not {}", space.ended().len(), model.ended.len());
            assert_eq!((space.len(), space.is_empty()), (model.bodies.len(), model.bodies.is_empty()));
            assert!(space.handles().eq(model.bodies.keys().copied()));
            assert!(model.bodies.iter().all(|(&handle, (b, body))| space.get(handle) == Some((b, body))));
        }
        let handle = self.handle();
        let known = self.model.bodies.contains_key(&handle);
        for space in &self.spaces {
            assert_eq!([space.contains(handle), space.get(handle).is_some()], [known; 2], "{handle}");
        }
    }

    fn query(&mut self) {
        let by = if self.source.below(2) == 0 { None } else { Some(self.source.body()) };
        let bodies =
            self.model.seen.iter().filter_map(|(&handle, &b)| Some((handle, b, self.model.bodies.get(&handle)?.1)));
        let all: Vec<(Handle, Aabb)> = bodies
            .filter(|(.., body)| by.is_none_or(|by| wanted(&by, body)))
            .map(|(handle, b, _)| (handle, b))
            .collect();
        let regions: Vec<Aabb> = (0..1 + self.source.below(3)).map(|_| self.source.aabb(self.world)).collect();
        let (point, direction) = (self.source.point(self.world), self.source.direction());
        let max = [INF, 1.0, 4.0, 0.0, -1.0, f32::NAN][self.source.below(6)];
        let k = [1, 2, 5, 400, 0][self.source.below(5)];
        for space in &self.spaces {
            check_queries(space, by.as_ref(), &all, &regions, &Ray { max, ..Ray::new(point, direction) }, k);
        }
    }
}

/// Compares queries with a loop over `all` bodies that they may find.
fn check_queries(space: &Space, by: Option<&Body>, all: &[(Handle, Aabb)], regions: &[Aabb], ray: &Ray, k: usize) {
    let view = by.map_or_else(|| space.all(), |by| space.view(by));
    let overlapping = |region: &Aabb| -> Vec<Handle> {
        all.iter().filter(|(_, b)| overlap(b, region)).map(|&(handle, _)| handle).collect()
    };
    let check_overlapping = |mut found: Vec<Handle>, result: Result<(), Error>, region: &Aabb| {
        found.sort_unstable();
        let right = check_boxes(&[*region]);
        assert_eq!(found, right.as_ref().map_or(vec![], |()| overlapping(region)), "{region:?}");
        assert_eq!(result, right);
    };
    let mut found = Vec::new();
    let result = view.query_box(&regions[0], |handle| found.push(handle));
    check_overlapping(found, result, &regions[0]);
    let mut found = Vec::new();
    let result = view.query_point(ray.origin, |handle| found.push(handle));
    check_overlapping(found, result, &Aabb::new(ray.origin, ray.origin));
    let mut found = vec![Vec::new(); regions.len()];
    let result = view.query_boxes(regions, |at, handle| found[at].push(handle));
    assert_eq!(result, check_boxes(regions));
    if result.is_ok() {
        found.into_iter().zip(regions).for_each(|(found, region)| check_overlapping(found, Ok(()), region));
    } else {
        assert!(found.concat().is_empty());
    }

    let hits = |b: &Aabb, max| -> Vec<(Handle, f32)> {
        all.iter().filter_map(|(handle, other)| Some((*handle, meeting(b, ray.direction, max, other)?))).collect()
    };
    let check_hits = |mut found: Vec<(Handle, f32)>, result: Result<(), Error>, right: Result<Vec<_>, Error>| {
        found.sort_by_key(|&(handle, _)| handle);
        assert_eq!(found, right.as_ref().map_or(&[][..], |right| right), "{ray:?}");
        assert_eq!(result, right.map(drop));
    };
    let not_finite = |values: &[f32]| values.iter().any(|v| !v.is_finite());
    let defect = if not_finite(&ray.origin) || not_finite(&ray.direction) || ray.max.is_nan() {
        Some(RayDefect::NotFinite)
    } else {
        (ray.direction == [0.0; 3]).then_some(RayDefect::NoDirection)
    };
    let right = defect.map_or(Ok(()), |defect| Err(Error::InvalidRay { defect }));
    let right = right.map(|()| hits(&Aabb::new(ray.origin, ray.origin), ray.max));
    let mut first: Option<(Handle, f32)> = None;
    for &(handle, t) in right.iter().flatten() {
        first = first.filter(|&(_, least)| least <= t).or(Some((handle, t)));
    }
    assert_eq!(view.first_hit(ray), right.as_ref().map(|_| first).map_err(Error::clone), "{ray:?}");
    let mut one = 0;
    let _ = view.cast_ray(ray, |_, _| {
        one += 1;
        -1.0
    });
    assert_eq!(one, usize::from(first.is_some()));
    let mut found = Vec::new();
    let result = view.cast_ray(ray, |handle, t| {
        found.push((handle, t));
        INF
    });
    check_hits(found, result, right);

    let mut right = check_boxes(&regions[..1]);
    if right.is_ok() && not_finite(&ray.direction) {
        right = Err(Error::InvalidRay { defect: RayDefect::NotFinite });
    }
    let mut found = Vec::new();
    let result = view.cast_box(&regions[0], ray.direction, |handle, t| {
        found.push((handle, t));
        INF
    });
    check_hits(found, result, right.map(|()| hits(&regions[0], 1.0)));

    let mut near: Vec<(Handle, f32)> = all.iter().map(|(handle, b)| (*handle, distance(ray.origin, b))).collect();
    near.sort_by(|(a, one), (b, other)| one.total_cmp(other).then(a.cmp(b)));
    near.truncate(k);
    let finite = !not_finite(&ray.origin);
    let right = if finite { Ok(near) } else { Err(Error::InvalidRay { defect: RayDefect::NotFinite }) };
    assert_eq!(view.nearest(ray.origin, k), right, "{:?}", ray.origin);
}
