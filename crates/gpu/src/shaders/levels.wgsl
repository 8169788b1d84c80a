// The levels of a tree over sorted boxes: eight consecutive boxes form a node, eight consecutive nodes a node of the
// next level, and so on. A node has no pointer: the positions of its children follow from its own. One list has all
// levels, one after the other.

fn span(level: u32) -> u32 {
    return (params.objects + (1u << (3u * level)) - 1u) >> (3u * level);
}

// Returns where a level begins in the list.
fn base(level: u32) -> u32 {
    var at = 0u;
    for (var k = 0u; k < level; k++) {
        at += span(k);
    }
    return at;
}
