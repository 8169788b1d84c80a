// The levels of a tree over boxes in an order: eight boxes that follow each other are a node, eight nodes a node of the next level, and so
// on. No node holds a pointer: where its children stand follows from where it stands. The levels follow each other in one list.

fn span(level: u32) -> u32 {
    return (params.objects + (1u << (3u * level)) - 1u) >> (3u * level);
}

// Where a level begins in the list.
fn base(level: u32) -> u32 {
    var at = 0u;
    for (var k = 0u; k < level; k++) {
        at += span(k);
    }
    return at;
}
