// Every function of sapwise.hpp against the definition of overlap, on bodies that come, move and go. Compiled with and
// without exceptions.
#include <sapwise.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <set>
#include <vector>

#define CHECK(condition) \
    if (!(condition)) std::printf("line %d: %s; %s\n", __LINE__, #condition, sw_last_error()), std::exit(1)

#ifdef SAPWISE_NO_EXCEPTIONS
#define DO(call) CHECK((call) == SW_OK)
template <class T> T value_of(sapwise::Result<T> result) {
    CHECK(result);
    return *result;
}
#define FAILS(call, expected) CHECK(status_of(call) == expected)
inline sapwise::Status status_of(sapwise::Status status) { return status; }
template <class T> sapwise::Status status_of(const sapwise::Result<T> &result) { return result.status; }
#else
#define DO(call) call
template <class T> T value_of(T value) { return value; }
#define FAILS(call, expected) \
    try { \
        (void)(call); \
        CHECK(!"it throws"); \
    } catch (const sapwise::Error &error) { \
        CHECK(error.status == expected && error.what()[0]); \
    }
#endif

namespace {

using sapwise::Box;
using sapwise::Handle;

std::mt19937 random_bits(7);
float random_float(float most) { return std::uniform_real_distribution<float>(0, most)(random_bits); }

Box random_box() {
    Box box;
    for (int a = 0; a < 3; a++) {
        box.min[a] = random_float(9);
        box.max[a] = box.min[a] + random_float(2);
    }
    return box;
}
bool overlap(const Box &a, const Box &b) {
    for (int k = 0; k < 3; k++) {
        if (a.min[k] > b.max[k] || b.min[k] > a.max[k]) return false;
    }
    return true;
}

struct Known {
    Box box;
    sapwise::Body body;
};
bool wants(const sapwise::Body &a, const sapwise::Body &b) {
    return (a.groups & b.masks) && (b.groups & a.masks) && (a.kind == SW_MOVING || b.kind == SW_MOVING)
        && (a.owner != b.owner || !a.owner);
}
using Pairs = std::set<std::pair<Handle, Handle>>;
Pairs as_set(sapwise::Span<const sapwise::Pair> pairs) {
    Pairs set;
    for (const auto &pair : pairs) CHECK(set.insert({pair.a, pair.b}).second && pair.a < pair.b);
    return set;
}
// An engine's own struct.
struct Thing {
    double mass;
    float low[4], high[4];
};

// Arrays of a derived struct are refused: its objects lie further apart than the boxes or bodies in them.
struct NamedBox : Box {
    int name;
};
struct NamedBody : sapwise::Body {
    int name;
};
template <class From, class To> constexpr bool becomes = std::is_convertible_v<From, To>;
static_assert(!becomes<std::vector<NamedBox> &, sapwise::Span<Box>>);
static_assert(!becomes<const std::vector<NamedBox> &, sapwise::Span<const Box>>);
static_assert(!becomes<const std::vector<NamedBox> &, sapwise::Boxes>);
static_assert(!becomes<const std::vector<NamedBody> &, sapwise::Span<const sapwise::Body>>);
static_assert(!becomes<const std::vector<Handle> &, sapwise::Span<Handle>>);
static_assert(!std::is_constructible_v<sapwise::Span<const Box>, const NamedBox *, std::size_t>);
static_assert(becomes<std::vector<Box> &, sapwise::Span<Box>> && becomes<const std::vector<Box> &, sapwise::Boxes>);
static_assert(becomes<sapwise::Span<Box>, sapwise::Span<const Box>> && becomes<std::array<Box, 2>, sapwise::Boxes>);
static_assert(std::is_constructible_v<sapwise::Span<const Box>, Box *, std::size_t>);

// The distances are compared with what the definition says, each box on its own.
void query(const sapwise::Space &space, const std::map<Handle, Known> &known, const sapwise::Body *by) {
    const Box box = random_box();
    auto expected = [&](auto of) {
        std::set<Handle> all;
        for (const auto &[handle, one] : known) {
            if (of(one.box) && (!by || wants(*by, one.body))) all.insert(handle);
        }
        return all;
    };
    std::set<Handle> found, inside;
    DO(space.query_box(box, [&](Handle handle) { CHECK(found.insert(handle).second); }, by));
    CHECK(found == expected([&](const Box &one) { return overlap(one, box); }));
    DO(space.query_point(box.min, [&](Handle handle) { inside.insert(handle); }, by));
    CHECK(inside == expected([&](const Box &one) { return overlap(one, {box.min, box.min}); }));

    const std::vector<Box> boxes = {box, random_box(), {box.min, box.min}};
    std::vector<std::set<Handle>> each(boxes.size());
    DO(space.query_boxes(boxes, [&](std::size_t k, Handle handle) { each[k].insert(handle); }, by));
    CHECK(each[0] == found && each[2] == inside);

    // Along an axis, so that the definition is exact.
    sapwise::Ray ray{box.min, {1, 0, 0}};
    std::map<Handle, float> hits;
    DO(space.cast_ray(ray, [&](Handle handle, float t) { hits[handle] = t; }, by));
    std::set<Handle> met = expected([&](const Box &one) {
        Box line{box.min, box.min};
        line.max[0] = 1000;
        return overlap(one, line);
    });
    CHECK(hits.size() == met.size());
    sapwise::Hit first{0, ray.max};
    for (auto [handle, t] : hits) {
        CHECK(met.count(handle) && std::abs(t - std::max(0.0f, known.at(handle).box.min[0] - box.min[0])) < 1e-5f);
        if (t < first.t) first = {handle, t};
    }
    sapwise::Hit hit = value_of(space.first_hit(ray, by));
    CHECK(hit.handle == first.handle && hit.t == first.t);
    std::size_t calls = 0;
    DO(space.cast_ray(ray, [&](Handle, float) { calls++; return -1.0f; }, by));
    CHECK(calls == std::min<std::size_t>(1, hits.size()));

    std::set<Handle> swept;
    DO(space.cast_box(box, {3, 0, 0}, [&](Handle handle, float) { swept.insert(handle); }, by));
    CHECK(swept == expected([&](const Box &one) {
        Box all = box;
        all.max[0] += 3;
        return overlap(one, all);
    }));

    float last = 0;
    std::set<Handle> nearest;
    DO(space.nearest(box.min, 5, [&](Handle handle, float distance) {
        CHECK(distance >= last && nearest.insert(handle).second);
        last = distance;
    }, by));
    CHECK(nearest.size() == std::min<std::size_t>(5, expected([](const Box &) { return true; }).size()));
    CHECK(inside.size() > 5 || std::includes(nearest.begin(), nearest.end(), inside.begin(), inside.end()));
}

void frames() {
    sapwise::Space space, saved;
    std::map<Handle, Known> known;
    Pairs before;
    std::size_t total = 0;
    for (int frame = 0; frame < 60; frame++) {
        for (int k = 0; k < (frame == 0 ? 150 : 5); k++) {
            sapwise::Body body(random_bits() % 3);
            body.groups = random_bits() % 16;
            body.masks = random_bits();
            body.owner = random_bits() % 4;
            body.user_data = random_bits();
            Box box = random_box();
            Handle handle = value_of(space.insert(box, body));
            CHECK(handle != 0 && known.emplace(handle, Known{box, body}).second);
        }
        std::vector<Handle> some;
        for (auto &[handle, one] : known) {
            if (random_bits() % 2) some.push_back(handle);
        }
        // As the library has them, in an engine's structs, and in two arrays.
        std::vector<Box> moved;
        std::vector<Thing> things(some.size());
        std::vector<float> low, high;
        for (std::size_t k = 0; k < some.size(); k++) {
            moved.push_back(random_box());
            known[some[k]].box = moved.back();
            std::copy_n(moved[k].min.data(), 3, things[k].low);
            std::copy_n(moved[k].max.data(), 3, things[k].high);
            low.insert(low.end(), moved[k].min.begin(), moved[k].min.end());
            high.insert(high.end(), moved[k].max.begin(), moved[k].max.end());
        }
        if (frame % 3 == 0) DO(space.set(some, moved));
        if (frame % 3 == 1) DO(space.set(some, {things[0].low, things[0].high, some.size(), sizeof(Thing)}));
        if (frame % 3 == 2) DO(space.set(some, {low.data(), high.data(), some.size(), 12}));
        for (int k = 0; k < 5; k++) {
            Handle handle = std::next(known.begin(), random_bits() % known.size())->first;
            if (k == 0) {
                known[handle].body.groups = 3;
                DO(space.set_body(handle, known[handle].body));
            } else {
                DO(space.remove(handle));
                FAILS(space.remove(handle), SW_STALE_HANDLE);
                known.erase(handle);
            }
        }
        DO(space.update());
        Pairs now, begun, ended;
        for (auto a = known.begin(); a != known.end(); ++a) {
            for (auto b = std::next(a); b != known.end(); ++b) {
                if (overlap(a->second.box, b->second.box) && wants(a->second.body, b->second.body)) {
                    now.insert({a->first, b->first});
                }
            }
        }
        auto less = [](const Pairs &all, const Pairs &without) {
            Pairs rest;
            auto to = std::inserter(rest, rest.end());
            std::set_difference(all.begin(), all.end(), without.begin(), without.end(), to);
            return rest;
        };
        CHECK(as_set(value_of(space.pairs())) == now);
        CHECK(as_set(value_of(space.begun())) == less(now, before));
        CHECK(as_set(value_of(space.ended())) == less(before, now));
        before = now;
        total += now.size();
        CHECK(space.size() == known.size());
        for (auto &[handle, one] : known) {
            auto found = value_of(space.find(handle));
            CHECK(space.contains(handle) && found.first.min == one.box.min && found.first.max == one.box.max);
            CHECK(found.second.user_data == one.body.user_data && found.second.kind == one.body.kind);
            CHECK(found.second.masks == one.body.masks && found.second.owner == one.body.owner);
        }
        query(space, known, nullptr);
        query(space, known, &known.begin()->second.body);
        // A copy that is restored goes on alike.
        DO(saved.assign(space));
        sapwise::Space twin = saved.clone();
        DO(twin.update());
        CHECK(as_set(value_of(twin.pairs())) == now && value_of(twin.begun()).size() == 0);
        std::vector<Handle> handles = value_of(space.handles());
        auto is = [](Handle handle, const auto &one) { return handle == one.first; };
        CHECK(std::equal(handles.begin(), handles.end(), known.begin(), is));
        CHECK(sw_space_handles(space.get(), handles.data(), 1) == SW_INVALID_ARGUMENT);
    }
    CHECK(total > 1000 && !space.describe().empty());
}

void arrays() {
    sapwise::Search search;
    std::vector<Box> boxes(300), others(200);
    std::generate(boxes.begin(), boxes.end(), random_box);
    std::generate(others.begin(), others.end(), random_box);
    std::vector<Thing> things(boxes.size());
    std::vector<sapwise::Body> bodies(400);
    for (auto &body : bodies) body.groups = random_bits() % 4, body.masks = random_bits();
    DO(search.set_sorted(true));
    for (bool filtered : {false, true}) {
        DO(search.set_bodies({bodies.data(), filtered ? bodies.size() : 0}));
        auto wanted = [&](std::size_t a, std::size_t b) {
            sapwise::Body all;
            auto of = [&](std::size_t id) { return filtered && id < bodies.size() ? bodies[id] : all; };
            return wants(of(a), of(b));
        };
        std::vector<std::pair<std::uint32_t, std::uint32_t>> within, between;
        for (std::size_t a = 0; a < boxes.size(); a++) {
            std::copy_n(boxes[a].min.data(), 3, things[a].low);
            std::copy_n(boxes[a].max.data(), 3, things[a].high);
            for (std::size_t b = a + 1; b < boxes.size(); b++) {
                if (overlap(boxes[a], boxes[b]) && wanted(a, b)) within.push_back({a, b});
            }
            for (std::size_t b = 0; b < others.size(); b++) {
                std::size_t id = boxes.size() + b;
                if (overlap(boxes[a], others[b]) && wanted(a, id)) between.push_back({a, id});
            }
        }
        auto same = [](sapwise::Span<const sapwise::IndexPair> pairs, const auto &expected) {
            return std::equal(pairs.begin(), pairs.end(), expected.begin(), expected.end(), [](auto &a, auto &b) {
                return a.a == b.first && a.b == b.second;
            });
        };
        sapwise::Boxes strided(things[0].low, things[0].high, things.size(), sizeof(Thing));
        CHECK(same(value_of(search.find_pairs(boxes)), within) && same(value_of(search.find_pairs(strided)), within));
        CHECK(same(value_of(search.find_pairs(boxes, others)), between));
        CHECK(same(value_of(search.find_pairs(strided, others)), between));
    }
    CHECK(value_of(search.find_pairs(std::vector<Box>())).size() == 0);
    DO(search.set_bodies({}));
    DO(search.set_limit(10));
    FAILS(search.find_pairs(boxes), SW_TOO_MANY_PAIRS);
    boxes[17].max[1] = std::numeric_limits<float>::quiet_NaN();
    FAILS(search.find_pairs(boxes), SW_INVALID_BOX);
    FAILS(search.find_pairs(others, boxes), SW_INVALID_BOX);
    CHECK(std::string(sw_last_error()).find("box 217 ") == 0);
    FAILS(search.save(), SW_CACHE);
    CHECK(!search.describe().empty());

    const double low[3] = {0.1, 0.2, 0.3}, high[3] = {0.7, 0.8, 0.9};
    Box box;
    CHECK(sw_box_from_doubles(low, high, box.bounds()) == SW_OK);
    const float motion[3] = {1, -1, 0};
    Box swept = box;
    CHECK(sw_box_sweep(swept.bounds(), motion) == SW_OK);
    for (int a = 0; a < 3; a++) {
        CHECK(box.min[a] <= low[a] && high[a] <= box.max[a] && box.max[a] < high[a] + 1e-6);
        CHECK(swept.min[a] <= box.min[a] && swept.max[a] >= box.max[a]);
    }
    CHECK(swept.max[0] >= box.max[0] + 1 && swept.min[1] <= box.min[1] - 1);
}

void callbacks() {
    sapwise::Space space;
    const std::vector<Box> boxes(9, Box{{0, 0, 0}, {1, 1, 1}});
    std::vector<Handle> handles(boxes.size());
    DO(space.insert(boxes, handles));
    DO(space.update());
    FAILS(space.set(sapwise::Span<const Handle>(handles.data(), 2), boxes), SW_INVALID_ARGUMENT);
    std::size_t calls = 0;
    DO(space.query_box(boxes[0], [&](Handle) { return ++calls < 4; }));
    CHECK(calls == 4);
    DO(space.query_box(boxes[0], [&](Handle handle) {
        FAILS(space.remove(handle), SW_BUSY);
        CHECK(space.contains(handle));
    }));
#ifndef SAPWISE_NO_EXCEPTIONS
    calls = 0;
    try {
        space.query_box(boxes[0], [&](Handle) { calls++; throw 42; });
        CHECK(!"it throws");
    } catch (int thrown) {
        CHECK(thrown == 42 && calls == 1);
    }
#endif
    const std::vector<sapwise::Body> bodies = {SW_MOVING, SW_FIXED, SW_FIXED};
    std::vector<Handle> three(3);
    DO(space.insert(std::vector<Box>(3, boxes[0]), three, bodies));
    for (std::size_t k = 0; k < 3; k++) CHECK(value_of(space.find(three[k])).second.kind == bodies[k].kind);
    FAILS(space.insert(boxes, three, bodies), SW_INVALID_ARGUMENT);
    DO(space.remove(three));
    DO(space.set_limit(30));
    FAILS(space.update(), SW_TOO_MANY_PAIRS);
    CHECK(std::string(sw_last_error()).find("limit of 30; raise it with sw_space_set_limit") != std::string::npos);
    DO(space.set_limit(0));
    DO(space.update());
    DO(space.remove(handles));
    DO(space.update());
    CHECK(space.size() == 0 && value_of(space.ended()).size() == 36);
    sapwise::Space moved = std::move(space);
    DO(moved.update());
    sw_options wrong = {};
    wrong.algorithm = "nothing@cpu1";
#ifdef SAPWISE_NO_EXCEPTIONS
    CHECK(!sapwise::Space(wrong) && sw_last_status() == SW_UNAVAILABLE);
#else
    FAILS(sapwise::Space(wrong), SW_UNAVAILABLE);
#endif
}

void measured(const char *folder) {
    sw_options options = {};
    options.flags = SW_MEASURE | SW_WAIT;
    options.cache_folder = folder;
    sapwise::Space space(options);
    CHECK(space.describe().find("costs: measured") != std::string::npos);
    DO(space.save());
    options.flags = 0;
    CHECK(sapwise::Space(options).describe().find("nothing was searched yet; costs: ") == 0);
    CHECK(sapwise::Space::measured(folder).describe().find("costs: usual until") != std::string::npos);
}

} // namespace

int main(int argc, char **argv) {
    frames();
    arrays();
    callbacks();
    if (argc > 1) measured(argv[1]);
    std::printf("ok\n");
}
