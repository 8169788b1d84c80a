// Sapwise: bodies with handles, the pairs of those whose boxes overlap, and queries. C99 and C++; sapwise.hpp has
// classes.
//
// Units: any unit of length, the same everywhere. A box is six floats: the lowest x, y and z, then the highest. Boxes
// are closed: those that touch overlap. Bounds may be infinite. A box is valid if it has no NaN and no minimum lies
// above its maximum.
//
// Arrays of boxes: `boxes` points to the minimum of the first one, the next begins `stride` bytes behind. With max NULL
// each maximum is behind its minimum; else `max` points to the first maximum, and these lie `stride` bytes apart too.
// So the boxes in your own structs need no copy of yours. Stride 0: 24 bytes, with max 12. Other strides are multiples
// of 4 that are not less. NULL is allowed if n is 0.
//
// Ownership: what sw_..._new returns is yours until sw_..._free. What other functions return is the library's, and
// valid as long as they say. Arguments stay yours, and no pointer to them is kept after the call.
//
// Threads: any thread may use an object. A call without const fails with SW_BUSY and does nothing while any other call
// uses the object; a const call fails while one without const does. So queries may run on several threads at once, and
// inside of callbacks, but not beside an update. After fork, the child makes its own objects and does not free the
// parent's.
//
// Errors: a function that fails returns another status than SW_OK, or NULL, or 0. sw_last_error has the message. Any
// function may return SW_NULL, SW_BUSY and SW_PANIC. After a failure a count or a single handle is 0, other results are
// unspecified. A panic never crosses this interface. A C++ exception in a callback ends the process: catch it there.
//
// Handles: 0 is none. Handles of two spaces may be equal: don't mix them. No body gets the handle of a removed one,
// except by sw_space_assign and after four billion bodies in its slot.
//
// Slots: handle >> 32 is a slot, an index for arrays of yours. The slot of a removed body is used again after the next
// sw_space_update that succeeds. If removed bodies count until then, slots are less than the most bodies at once.
//
// Generated from bindings/c/src by `SAPWISE_WRITE_HEADER=1 cargo test --test header`. Don't edit.

#ifndef SAPWISE_H
#define SAPWISE_H

#include <stddef.h>
#include <stdint.h>

// The default body, for initialisers: sw_body body = SW_BODY_DEFAULT;
#define SW_BODY_DEFAULT {0xFFFFFFFFu, 0xFFFFFFFFu, 0u, 0u, 0u}

// A body that moves.
#define SW_MOVING 0

// A body that rarely moves, such as a wall. It may be set all the same.
#define SW_FIXED 1

// A body that the program moves along a path, such as a lift.
#define SW_KINEMATIC 2

// Loads the costs of this machine, or measures for two seconds if none are kept. Without it, costs are only loaded,
// and only if there is a cache_folder.
#define SW_MEASURE 1

// Does that before the constructor returns. Without it, a background thread does, and usual costs decide meanwhile.
#define SW_WAIT 2

// Does not correct expected costs by the times of updates.
#define SW_NO_LEARNING 4

// Never tries an algorithm to learn its cost.
#define SW_NO_EXPLORING 8

// What a function returns. 0 is success. After any other value, sw_last_error has the message.
enum sw_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Success.
    SW_OK = 0,
    // A pointer that must not be NULL is NULL.
    SW_NULL = 1,
    // A stride, an alignment, a flag, a kind or a text that can't be used.
    SW_INVALID_ARGUMENT = 2,
    // A box has a NaN, or a minimum above its maximum. The message has the index or the handle.
    SW_INVALID_BOX = 3,
    // A ray, a motion or a point is not finite, or a direction is zero.
    SW_INVALID_RAY = 4,
    // The handle names no body of this space, such as that of a removed one. One of another space may name a body.
    SW_STALE_HANDLE = 5,
    // More boxes than 32 bits can number, or than fit into the address space.
    SW_TOO_MANY = 6,
    // More pairs than the limit of the search or the space.
    SW_TOO_MANY_PAIRS = 7,
    // The system refused memory.
    SW_OUT_OF_MEMORY = 8,
    // No such algorithm, or it can't run here.
    SW_UNAVAILABLE = 9,
    // Another call uses the object: on another thread, or a query whose callback this is.
    SW_BUSY = 10,
    // The object was freed before. Only debug builds of the library know that.
    SW_FREED = 11,
    // The cache can't be written, or there is none.
    SW_CACHE = 12,
    // A fault of the library. The object of the call can only be freed.
    SW_PANIC = 13,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sw_status sw_status;
#else
typedef int32_t sw_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Finds the pairs of boxes in arrays, one array after the other: those of a frame after those of the previous one.
typedef struct sw_search sw_search;

// Bodies with handles, and the pairs of those that overlap. The lists of pairs show the last sw_space_update. So do
// queries: they find bodies where they were then, and none that was inserted or removed since. sw_space_get,
// sw_space_contains, sw_space_len and sw_space_handles show each call at once. A call that fails changes nothing,
// except sw_space_update.
typedef struct sw_space sw_space;

// What a body may meet. Initialise it with SW_BODY_DEFAULT.
typedef struct {
    // The groups of the body, one bit each. Default: all.
    uint32_t groups;
    // The groups that it meets, one bit each. The masks of both bodies of a pair must allow the other. Default: all.
    uint32_t masks;
    // What it is a part of, such as a ragdoll. Bodies with the same owner do not meet. 0: of nothing.
    uint32_t owner;
    // SW_MOVING, SW_FIXED or SW_KINEMATIC. Two bodies of the latter two kinds do not meet.
    uint32_t kind;
    // A number of yours, or a pointer, for sw_space_get.
    uint64_t user_data;
} sw_body;

// Gets a handle that a query found. Returns 0 for no more.
typedef int (*sw_found)(void *user, uint64_t handle);

// Gets a handle that sw_space_query_boxes found, and the index of the box. Returns 0 for no more.
typedef int (*sw_found_in)(void *user, size_t index, uint64_t handle);

// Gets a body that a ray or a moved box meets, and the t of it, not in the order of t. Returns the new maximum
// of t, which never rises: t itself to find the first hit, INFINITY to find all, -1 to stop.
typedef float (*sw_hit)(void *user, uint64_t handle, float t);

// Gets a handle and its distance, nearest first. Returns 0 for no more.
typedef int (*sw_near)(void *user, uint64_t handle, float distance);

// How pairs are searched. All zero: the usual costs, on all cores that the process may use.
typedef struct {
    // The most threads, the calling one included. 0: as many as the process may use. 1: only the calling thread.
    uint32_t threads;
    // SW_MEASURE and so on, joined by |.
    uint32_t flags;
    // Always this algorithm, such as "bvh@cpu1", in place of the cheapest. NULL: the cheapest.
    const char *algorithm;
    // Folder of the costs that were measured before, in UTF-8. NULL: sapwise in the user's cache folder, for
    // SW_MEASURE.
    const char *cache_folder;
} sw_options;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Rounds a box of doubles outward: the floats contain every point between them. Far from the origin floats are
// coarse, 0.06 at a million: subtract an origin near the boxes first. SW_NULL.
//
sw_status sw_box_from_doubles(const double min[3], const double max[3], float bounds[6]);

// Grows a box so that it contains the whole motion. Rounded outward. SW_NULL.
//
sw_status sw_box_sweep(float bounds[6], const float motion[3]);

// Calls `found` for each body whose box overlaps these bounds. After 0 there are no more calls. A query finds the
// bodies that the body `by` may meet, and all if it is NULL. SW_INVALID_BOX, SW_INVALID_ARGUMENT, SW_OUT_OF_MEMORY.
//
sw_status sw_space_query_box(const sw_space *space,
                             const float bounds[6],
                             const sw_body *by,
                             sw_found found,
                             void *user);

// Calls `found` for each of n boxes and each body whose box overlaps it. The order is not that of the boxes. Boxes
// that do not lie as in a float[n][6] are copied once. Otherwise as sw_space_query_box; an invalid box is found before
// the first call.
sw_status sw_space_query_boxes(const sw_space *space,
                               const float *boxes,
                               size_t n,
                               size_t stride,
                               const float *max,
                               const sw_body *by,
                               sw_found_in found,
                               void *user);

// Calls `found` for each body whose box contains a point. Otherwise as sw_space_query_box.
//
sw_status sw_space_query_point(const sw_space *space,
                               const float point[3],
                               const sw_body *by,
                               sw_found found,
                               void *user);

// Calls `hit` for each body whose box meets the ray origin + t * direction, 0 <= t <= max, with the t at which the
// ray enters the box: 0 if it begins there. max may be INFINITY; a ray with a negative one meets nothing.
// SW_INVALID_RAY, SW_OUT_OF_MEMORY.
//
sw_status sw_space_cast_ray(const sw_space *space,
                            const float origin[3],
                            const float direction[3],
                            float max,
                            const sw_body *by,
                            sw_hit hit,
                            void *user);

// Writes the body that a ray meets first and the t of it; of several at the same t the one with the lowest handle.
// If there is none, handle 0 and the t max. Otherwise as sw_space_cast_ray.
//
sw_status sw_space_first_hit(const sw_space *space,
                             const float origin[3],
                             const float direction[3],
                             float max,
                             const sw_body *by,
                             uint64_t *handle,
                             float *t);

// Calls `hit` for each body whose box is met by a box that moves by `motion`, with the share of the motion after
// which they touch: 0 if they overlap at the start. SW_INVALID_BOX, SW_INVALID_RAY, SW_OUT_OF_MEMORY.
//
sw_status sw_space_cast_box(const sw_space *space,
                            const float bounds[6],
                            const float motion[3],
                            const sw_body *by,
                            sw_hit hit,
                            void *user);

// Calls `near` with the k bodies whose boxes are nearest to a point: 0 if it is inside. Of several at the same
// distance, those with the lowest handles come first. SW_INVALID_RAY if the point is not finite, SW_OUT_OF_MEMORY.
//
sw_status sw_space_nearest(const sw_space *space,
                           const float point[3],
                           size_t k,
                           const sw_body *by,
                           sw_near near,
                           void *user);

// Makes a search. NULL for options: the usual costs, on all cores that the process may use. NULL on failure:
// SW_INVALID_ARGUMENT, SW_UNAVAILABLE or SW_PANIC.
sw_search *sw_search_new(const sw_options *options);

// Frees a search and its list of pairs. Otherwise as sw_space_free.
sw_status sw_search_free(sw_search *search);

// Sets the most pairs, 8 bytes each, from the next call on. 0, the default: no limit. A call that would find more is
// SW_TOO_MANY_PAIRS.
sw_status sw_search_set_limit(sw_search *search, size_t limit);

// Sets whether pairs are sorted, by the first member, then by the second: 1 or 0, from the next call on. Sorted
// lists are the same on every machine. Default: 0, which is faster.
sw_status sw_search_set_sorted(sw_search *search, int32_t sorted);

// Sets what the boxes of the next calls may meet, n of them; boxes beyond may meet all. The bodies are copied, their
// user_data is not used. n = 0: all boxes may meet all. SW_INVALID_ARGUMENT, SW_TOO_MANY.
sw_status sw_search_set_bodies(sw_search *search, const sw_body *bodies, size_t n);

// Returns the pairs of n boxes that overlap and may meet, and writes their number: 2 * count indices, of each pair
// the lower one first, each pair once. Touching boxes overlap. The list is the search's, and valid until its next
// call. Boxes that do not lie as in a float[n][6] are copied once.
//
// NULL on failure, with count 0: SW_NULL, SW_INVALID_ARGUMENT, SW_INVALID_BOX with the index, SW_TOO_MANY,
// SW_TOO_MANY_PAIRS, SW_OUT_OF_MEMORY, SW_UNAVAILABLE, SW_BUSY.
const uint32_t *sw_find_pairs(const float *boxes,
                              size_t n,
                              size_t stride,
                              const float *max,
                              sw_search *search,
                              size_t *count);

// Returns the pairs of a box of one array and a box of another. Indices run through the first array, then continue
// through the second: its first box has the index n. So do those of sw_search_set_bodies and of messages. Otherwise
// as sw_find_pairs.
const uint32_t *sw_find_pairs_between(const float *boxes,
                                      size_t n,
                                      size_t stride,
                                      const float *max,
                                      const float *other_boxes,
                                      size_t other_n,
                                      size_t other_stride,
                                      const float *other_max,
                                      sw_search *search,
                                      size_t *count);

// As sw_space_save.
sw_status sw_search_save(const sw_search *search);

// As sw_space_describe, of sw_find_pairs.
size_t sw_search_describe(const sw_search *search, char *text, size_t size);

// Makes an empty space with the usual costs, on all cores that the process may use. NULL on failure: SW_UNAVAILABLE
// or SW_PANIC.
sw_space *sw_space_new(void);

// Makes an empty space with the costs of this machine: from a folder, else a background thread measures for two
// seconds and usual costs decide meanwhile. NULL: sapwise in the user's cache folder. As sw_space_new_with with
// SW_MEASURE.
sw_space *sw_space_new_measured(const char *cache_folder);

// Makes an empty space. NULL for options: as sw_space_new. NULL on failure: SW_INVALID_ARGUMENT, SW_UNAVAILABLE or
// SW_PANIC. A cache that can't be read is no failure: sw_space_describe reports it.
sw_space *sw_space_new_with(const sw_options *options);

// Frees a space. Its threads end soon after: don't unload the library right away. NULL is allowed. SW_BUSY, and
// nothing is freed, if a query of it runs: don't free it in a callback.
sw_status sw_space_free(sw_space *space);

// Makes a copy that continues as the original would: the same calls give the same lists. It runs on the same helper
// threads, and learns by itself. NULL on failure: SW_NULL, SW_BUSY or SW_PANIC.
sw_space *sw_space_clone(const sw_space *space);

// Makes a space what another one is, as a game does that goes back to an earlier state. It keeps its threads and
// what it has learned. Handles of bodies inserted meanwhile become stale, and the same calls give them out again.
sw_status sw_space_assign(sw_space *space, const sw_space *from);

// Sets the most pairs that an update may find, from the next one on. 0, the default: no limit. An update that would
// find more is SW_TOO_MANY_PAIRS. Pairs with bodies that were not set for some updates do not count.
sw_status sw_space_set_limit(sw_space *space, size_t limit);

// Makes room for more bodies, so that inserting them allocates little. SW_TOO_MANY, SW_OUT_OF_MEMORY.
sw_status sw_space_reserve(sw_space *space, size_t more);

// Inserts a body and writes its handle. body: NULL for the default. SW_INVALID_BOX, SW_INVALID_ARGUMENT,
// SW_TOO_MANY, SW_OUT_OF_MEMORY.
//
sw_status sw_space_insert(sw_space *space, const float bounds[6], const sw_body *body, uint64_t *handle);

// Inserts a body like this one for each of n boxes, and writes n handles. Errors as sw_space_insert, with the index
// of the first wrong box; then nothing is inserted. Boxes that do not lie as in a float[n][6] are copied once. For a
// user_data each: sw_space_insert_bodies.
sw_status sw_space_insert_many(sw_space *space,
                               const float *boxes,
                               size_t n,
                               size_t stride,
                               const float *max,
                               const sw_body *body,
                               uint64_t *handles);

// Inserts n boxes with a body each. Otherwise as sw_space_insert_many.
sw_status sw_space_insert_bodies(sw_space *space,
                                 const float *boxes,
                                 size_t n,
                                 size_t stride,
                                 const float *max,
                                 const sw_body *bodies,
                                 uint64_t *handles);

// Sets the box of a body. SW_STALE_HANDLE, SW_INVALID_BOX.
//
sw_status sw_space_set(sw_space *space, uint64_t handle, const float bounds[6]);

// Sets the boxes of n bodies. Reads them where they lie. Errors as sw_space_set, for the first wrong one; then none
// is set.
sw_status sw_space_set_many(sw_space *space,
                            const uint64_t *handles,
                            const float *boxes,
                            size_t n,
                            size_t stride,
                            const float *max);

// Sets what a body may meet. Pairs begin and end by that too. SW_STALE_HANDLE, SW_INVALID_ARGUMENT.
sw_status sw_space_set_body(sw_space *space, uint64_t handle, const sw_body *body);

// Removes a body. Its pairs end at the next update. SW_STALE_HANDLE.
sw_status sw_space_remove(sw_space *space, uint64_t handle);

// Removes n bodies. A handle may be given twice. SW_STALE_HANDLE for the first stale one; then none is removed.
sw_status sw_space_remove_many(sw_space *space, const uint64_t *handles, size_t n);

// Finds all pairs, and which began and ended since the previous update. SW_TOO_MANY_PAIRS, SW_OUT_OF_MEMORY,
// SW_UNAVAILABLE: then no pair has begun or ended, pairs are missing, and the next update compares with the last one
// that succeeded.
sw_status sw_space_update(sw_space *space);

// Returns the pairs of bodies that overlap and may meet, and writes their number: 2 * count handles, of each pair
// the lower one first, each pair once. Touching bodies overlap. The order depends on the calls alone, not on threads
// or time. The list is the space's, and valid until its next update, sw_space_assign or sw_space_free. NULL on
// failure, with count 0: SW_NULL, SW_BUSY.
const uint64_t *sw_space_pairs(const sw_space *space, size_t *count);

// Returns the pairs that the previous update did not have, ascending. Otherwise as sw_space_pairs.
const uint64_t *sw_space_begun(const sw_space *space, size_t *count);

// Returns the pairs that only the previous update had. Otherwise as sw_space_begun. Those of removed bodies are among
// them: sw_space_get fails for these, but no other body has their slot before the next sw_space_insert.
const uint64_t *sw_space_ended(const sw_space *space, size_t *count);

// Returns the number of bodies. 0 on failure: SW_NULL, SW_BUSY.
size_t sw_space_len(const sw_space *space);

// Returns whether there is a body with this handle: 1 or 0. 0 on failure, also beside an update: SW_NULL, SW_BUSY.
int32_t sw_space_contains(const sw_space *space, uint64_t handle);

// Writes the box and the body of a handle, as set last. Either may be NULL. SW_STALE_HANDLE.
//
sw_status sw_space_get(const sw_space *space, uint64_t handle, float bounds[6], sw_body *body);

// Writes the handles of all bodies, ascending, at most n. SW_INVALID_ARGUMENT if there are more than n.
sw_status sw_space_handles(const sw_space *space, uint64_t *handles, size_t n);

// Saves the costs that the space has learned, for the next start on this machine. SW_CACHE if there is no cache, it
// can't be written, the measurement has not ended, or it had an implausible value.
sw_status sw_space_save(const sw_space *space);

// Writes which algorithm ran last and why, where the costs came from, and what went wrong at the start: a text for
// people. At most size bytes, with a zero at the end. Returns the length of the whole text. 0 on failure: SW_NULL,
// SW_BUSY.
size_t sw_space_describe(const sw_space *space, char *text, size_t size);

// Returns the message of the last failed call of this thread, in UTF-8. "" if there was none. It is valid until the
// next failed call of this thread, or the thread's end. Any thread may call this.
const char *sw_last_error(void);

// Returns the status of the last failed call of this thread, for functions that return NULL or 0. SW_OK if there was
// none. Any thread may call this.
sw_status sw_last_status(void);

// Returns the version of the library, such as "0.1.0". It is never freed. Any thread may call this.
const char *sw_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SAPWISE_H */
