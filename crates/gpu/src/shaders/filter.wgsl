// The filter on pairs. Two boxes are no pair unless each is in a group of the other's mask, unless one may move, and if
// they have the same owner.

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

fn passes(a: u32, b: u32) -> bool {
    let m = membership(a);
    let o = membership(b);
    return (m.x & o.y) != 0u && (o.x & m.y) != 0u && (m.w & o.w) == 0u && (m.z != o.z || m.z == 0u);
}
