/* Bodies that move, the pairs that begin and end, and a ray. Prints "ok" at the end. */
#include <sapwise.h>
#include <stdio.h>
#include <stdlib.h>

static void check(int ok) {
    if (!ok) {
        fprintf(stderr, "sapwise: %s\n", sw_last_error());
        exit(1);
    }
}

int main(void) {
    sw_space *space = sw_space_new();
    check(space != NULL);
    const float wall_box[6] = {0, 0, 0, 1, 4, 4}, player_box[6] = {3, 1, 1, 4, 2, 2}, moved[6] = {1, 1, 1, 2, 2, 2};
    sw_body fixed = SW_BODY_DEFAULT;
    fixed.kind = SW_FIXED;
    uint64_t wall, player, first;
    check(sw_space_insert(space, wall_box, &fixed, &wall) == SW_OK);
    check(sw_space_insert(space, player_box, NULL, &player) == SW_OK);
    for (int frame = 0; frame < 3; frame++) {
        check(sw_space_set(space, player, frame == 1 ? moved : player_box) == SW_OK);
        check(sw_space_update(space) == SW_OK);
        size_t pairs, begun, ended;
        sw_space_pairs(space, &pairs);
        const uint64_t *begins = sw_space_begun(space, &begun);
        sw_space_ended(space, &ended);
        printf("frame %d: %zu pairs, %zu begun, %zu ended\n", frame, pairs, begun, ended);
        check(begun == (frame == 1) && ended == (frame == 2) && (!begun || (begins[0] == wall && begins[1] == player)));
    }
    const float origin[3] = {9, 1.5f, 1.5f}, direction[3] = {-1, 0, 0};
    float t;
    check(sw_space_first_hit(space, origin, direction, 100, NULL, &first, &t) == SW_OK);
    check(first == player && t == 5);
    check(sw_space_free(space) == SW_OK);
    printf("ok, version %s\n", sw_version());
    return 0;
}
