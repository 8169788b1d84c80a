//! Spaces and boxes, serialised. `properties` has snapshots in the midst of random calls.

use sapwise::{Aabb, Body, Handle, Space};
use serde_json::{Value, json};

/// Returns a space with a free slot, a resting body that was set, a new one and a removed one.
fn space() -> Space {
    let mut space = Space::new();
    let row: Vec<Aabb> = (0..68).map(|k| Aabb::cube([k as f32, 0.0, 0.0], 0.5)).collect();
    let handles = space.insert_all(&row, Body::fixed().user_data(7)).unwrap();
    let player = space.insert(row[2], Body::default()).unwrap();
    space.update().unwrap();
    space.remove_all(&[handles[1], handles[5], handles[6]]).unwrap();
    space.update().unwrap();
    space.set(handles[2], row[40]).unwrap();
    space.insert(row[0], Body::default()).unwrap();
    space.insert(row[0], Body::default()).unwrap();
    space.remove(player).unwrap();
    space
}

#[test]
fn snapshot_has_this_form() {
    let mut space = Space::new();
    let unit = Aabb::new([0.0; 3], [1.0, 1.0, f32::INFINITY]);
    let gone = space.insert(unit, Body::default()).unwrap();
    let wall = space.insert(unit, Body::fixed()).unwrap();
    space.insert(unit, Body::kinematic().groups(1).masks(2).owner(3).user_data(4)).unwrap();
    space.update().unwrap();
    space.remove(gone).unwrap();
    space.set(wall, Aabb::new([0.5; 3], [1.0; 3])).unwrap();
    space.set_limit(Some(9));
    let aabb = json!({ "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, "inf"] });
    let all = u32::MAX;
    let membership =
        |groups, mask, fixed, owner| json!({ "groups": groups, "mask": mask, "fixed": fixed, "owner": owner });
    let body =
        |membership, kinematic, data| json!({ "membership": membership, "kinematic": kinematic, "user_data": data });
    let held = |aabb: &Value, body, patience: [u64; 2], previous: Value, removed| {
        let stage = json!({ "active": patience });
        let held = json!({ "aabb": aabb, "body": body, "stage": stage, "previous": previous, "removed": removed });
        json!({ "generation": 1, "held": held })
    };
    let now = json!({ "min": [0.5, 0.5, 0.5], "max": [1.0, 1.0, 1.0] });
    let handles = [1_u64 << 32 | 1, 2_u64 << 32 | 1];
    let form = json!({
        "slots": [
            held(&aabb, body(membership(all, all, false, 0), false, 0), [8, 8], aabb.clone(), true),
            held(&now, body(membership(all, all, true, 0), false, 0), [0, 0], aabb.clone(), false),
            held(&aabb, body(membership(1, 2, true, 3), true, 4), [8, 8], Value::Null, false),
        ],
        "free": [],
        "pairs": [[0, 1], [0, 2]],
        "begun": [[1, handles[0]], [1, handles[1]]],
        "ended": [],
        "limit": 9,
    });
    assert_eq!(serde_json::to_value(&space).unwrap(), form);
    let restored: Space = serde_json::from_value(form.clone()).unwrap();
    assert_eq!(serde_json::to_value(&restored).unwrap(), form);
    let last = Handle::from_bits(handles[1]).unwrap();
    assert_eq!(restored.pairs(), [(gone, wall), (gone, last)]);
    assert!(restored.contains(last) && !restored.contains(gone));
}

#[test]
fn malformed_snapshots_say_what_is_wrong() {
    let right = serde_json::to_value(space()).unwrap();
    assert_eq!(right["free"], json!([6]));
    assert_eq!(right["slots"][2]["held"]["stage"], "resting");
    for (place, wrong, message) in [
        ("/slots/4/generation", json!(0), "slot 4 has the generation 0"),
        ("/slots/4/held", json!(null), "slot 4 has no body and is not free"),
        ("/slots/4/held/aabb/min/1", json!("NaN"), "slot 4 has a bound that is not a number"),
        ("/slots/4/held/aabb/min/1", json!("low"), "invalid value: string \"low\", expected a number, \"inf\" or"),
        ("/slots/4/held/aabb/min/1", json!(1), "slot 4 is inverted"),
        ("/slots/2/held/previous/max/0", json!("-inf"), "slot 2 is inverted"),
        ("/slots/4/held/stage", json!("asleep"), "unknown variant `asleep`"),
        ("/slots", json!([]), "free slot 6 "),
        ("/free", json!([]), "slot 6 has no body and is not free"),
        ("/free", json!([6, 6]), "free slot 6 "),
        ("/free", json!([6, 2]), "free slot 2 has a body"),
        ("/pairs/0", json!([2, 70]), "pair (2, 70) is not of two slots with bodies"),
        ("/pairs/0", json!([4, 3]), "pair (4, 3) is not of two slots with bodies, the lower one first"),
        ("/pairs/0", json!([6, 7]), "pair (6, 7) is not of two slots with bodies"),
        ("/pairs", json!([[3, 4], [0, 2], [3, 4]]), "pair (3, 4) is there twice"),
        ("/pairs", json!([[4, 68], [3, 68]]), "do not ascend"),
        ("/begun", json!([[0, 1]]), "expected a nonzero u64"),
    ] {
        let mut snapshot = right.clone();
        *snapshot.pointer_mut(place).unwrap() = wrong;
        let error = serde_json::from_value::<Space>(snapshot).unwrap_err().to_string();
        assert!(error.contains(message), "{place}: {error}");
    }
}

#[test]
fn bounds_read_back_as_they_were() {
    let odd = [7.038_531e-26, -0.0, 0.1, f32::MAX, 1.0e-45, f32::NEG_INFINITY];
    let b = Aabb::new([odd[0], odd[1], odd[2]], [odd[3], odd[4], odd[5]]);
    let text = serde_json::to_string(&b).unwrap();
    let read: Aabb = serde_json::from_str(&text).unwrap();
    let bits = |b: &Aabb| [b.min, b.max].map(|corner| corner.map(f32::to_bits));
    assert_eq!(bits(&read), bits(&b));
    let whole: Aabb = serde_json::from_str(r#"{ "min": [-1, 0, "-inf"], "max": [1, 2.5, "inf"] }"#).unwrap();
    assert_eq!(whole, Aabb::new([-1.0, 0.0, f32::NEG_INFINITY], [1.0, 2.5, f32::INFINITY]));
    assert!(serde_json::from_str::<Aabb>(r#"{ "min": [0, 0], "max": [1, 1, 1] }"#).is_err());
}
