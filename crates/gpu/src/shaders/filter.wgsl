// The filter on pairs. Each box of a pair is in a group of the other's mask, one of them may move, and their owners
// differ unless they have none.

// Groups, mask, owner (0: none), and 1 if the box is fixed, by the number of the box in the frame.
@group(0) @binding(9) var<storage, read> memberships: array<vec4u>;

// Returns the membership of the box with this number. A box beyond the end of the filter is in every group.
fn membership(id: u32) -> vec4u {
    let at = id & ~OWNER;
    if (at < params.members) {
        return memberships[at];
    }
    return vec4u(0xffffffffu, 0xffffffffu, 0u, 0u);
}

// The membership of the box whose pairs this invocation searches.
var<private> own: vec4u;

fn filter_for(row: u32) {
    own = membership(row);
}

fn passes(other: u32) -> bool {
    let m = membership(other);
    return (own.x & m.y) != 0u && (m.x & own.y) != 0u && (own.w & m.w) == 0u && (own.z != m.z || own.z == 0u);
}
