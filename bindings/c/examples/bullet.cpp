// Sapwise beside Bullet's broad phase.
//
//   bullet [FRAMES]  a small world of Bullet's: in each frame, the pairs of its broad phase against those of a Space;
//                    default: 400 frames
//   bullet --bench   10 000 moving boxes: the time of btDbvtBroadphase over that of sw_space_update, interleaved
#include <sapwise.hpp>

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

// An index of a body for each of two, the lower one first.
using Ids = std::pair<int, int>;

// Minimum, then maximum, 32 bytes apart from body to body: what the engine has anyway. Sapwise reads it in place.
struct Bounds {
    btVector3 min, max;
};
sapwise::Boxes boxes(const std::vector<Bounds> &bounds) {
    return {&bounds[0].min[0], &bounds[0].max[0], bounds.size(), sizeof bounds[0]};
}

// Pairs of Bullet's cache are those of fat boxes, and pairs that ended stay for some frames: without both.
std::set<Ids> pairs_of(btOverlappingPairCache &cache) {
    std::set<Ids> pairs;
    for (int k = 0; k < cache.getNumOverlappingPairs(); k++) {
        const btBroadphasePair &pair = cache.getOverlappingPairArray()[k];
        const btBroadphaseProxy &a = *pair.m_pProxy0, &b = *pair.m_pProxy1;
        if (TestAabbAgainstAabb2(a.m_aabbMin, a.m_aabbMax, b.m_aabbMin, b.m_aabbMax)) {
            auto id = [](const btBroadphaseProxy &of) {
                return static_cast<btCollisionObject *>(of.m_clientObject)->getUserIndex();
            };
            pairs.insert(std::minmax({id(a), id(b)}));
        }
    }
    return pairs;
}

struct World {
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
    btBoxShape ground{{20, 1, 20}}, cube{{0.5f, 0.5f, 0.5f}};
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    std::vector<sapwise::Handle> handles;
    sapwise::Space space;

    ~World() {
        while (!bodies.empty()) remove(bodies.size() - 1);
    }
    void add(btCollisionShape &shape, btScalar mass, const btVector3 &place, int group, int mask) {
        btVector3 inertia(0, 0, 0);
        shape.calculateLocalInertia(mass, inertia);
        btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &shape, inertia);
        info.m_startWorldTransform.setOrigin(place);
        bodies.push_back(std::make_unique<btRigidBody>(info));
        bodies.back()->setUserIndex(static_cast<int>(bodies.size() - 1));
        world.addRigidBody(bodies.back().get(), group, mask);
        sapwise::Body body(mass > 0 ? SW_MOVING : SW_FIXED);
        body.groups = static_cast<std::uint32_t>(group);
        body.masks = static_cast<std::uint32_t>(mask);
        body.user_data = bodies.size() - 1;
        handles.push_back(space.insert(box_of(*bodies.back()), body));
    }
    // The last one takes its index.
    void remove(std::size_t at) {
        world.removeRigidBody(bodies[at].get());
        space.remove(handles[at]);
        std::swap(bodies[at], bodies.back());
        std::swap(handles[at], handles.back());
        bodies.pop_back();
        handles.pop_back();
        if (at < bodies.size()) {
            bodies[at]->setUserIndex(static_cast<int>(at));
            sapwise::Body body = space.find(handles[at]).second;
            body.user_data = at;
            space.set_body(handles[at], body);
        }
    }
    static sapwise::Box box_of(const btRigidBody &body) {
        const btBroadphaseProxy &proxy = *body.getBroadphaseHandle();
        const btVector3 &low = proxy.m_aabbMin, &high = proxy.m_aabbMax;
        return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
    }
    std::set<Ids> space_pairs() {
        std::vector<Bounds> bounds;
        for (const auto &body : bodies) {
            bounds.push_back({body->getBroadphaseHandle()->m_aabbMin, body->getBroadphaseHandle()->m_aabbMax});
        }
        space.set(handles, boxes(bounds));
        space.update();
        std::set<Ids> pairs;
        for (const sapwise::Pair &pair : space.pairs()) {
            auto id = [&](sapwise::Handle handle) { return static_cast<int>(space.find(handle).second.user_data); };
            pairs.insert(std::minmax({id(pair.a), id(pair.b)}));
        }
        return pairs;
    }
};

int compare(std::size_t frames) {
    World world;
    std::mt19937 random(1);
    std::uniform_real_distribution<float> place(-8, 8);
    world.add(world.ground, 0, {0, -1, 0}, btBroadphaseProxy::StaticFilter, ~btBroadphaseProxy::StaticFilter);
    world.add(world.ground, 0, {21, 0, 0}, btBroadphaseProxy::StaticFilter, ~btBroadphaseProxy::StaticFilter);
    auto drop = [&] {
        // Debris meets no debris.
        bool debris = random() % 4 == 0;
        int group = debris ? btBroadphaseProxy::DebrisFilter : btBroadphaseProxy::DefaultFilter;
        int mask = debris ? ~btBroadphaseProxy::DebrisFilter : btBroadphaseProxy::AllFilter;
        world.add(world.cube, 1, {place(random), 4 + place(random) / 2, place(random)}, group, mask);
    };
    for (int k = 0; k < 300; k++) drop();
    std::size_t pairs = 0;
    for (std::size_t frame = 0; frame < frames; frame++) {
        if (frame % 5 == 4) {
            world.remove(2 + random() % (world.bodies.size() - 2));
            drop();
        }
        world.world.stepSimulation(1 / 60.0f, 0);
        std::set<Ids> bullet = pairs_of(*world.broadphase.getOverlappingPairCache()), ours = world.space_pairs();
        if (bullet != ours) {
            std::printf("frame %zu: Bullet has %zu pairs, Sapwise %zu\n", frame, bullet.size(), ours.size());
            return 1;
        }
        pairs += ours.size();
    }
    std::printf("ok, the same %zu pairs in %zu frames\n", pairs, frames);
    return pairs > 100 * frames ? 0 : 1;
}

// The scene `uniform`: unit cubes in a cube of edge 2 n^(1/3), with steps of up to 0.05 edges on each axis.
struct Uniform {
    std::mt19937 random{1};
    float edge;
    std::vector<Bounds> bounds;

    explicit Uniform(std::size_t n) : edge(2 * std::cbrt(static_cast<float>(n))), bounds(n) {
        for (Bounds &of : bounds) {
            for (int a = 0; a < 3; a++) put(of, a, edge * unit());
        }
    }
    float unit() { return std::uniform_real_distribution<float>(0, 1)(random); }
    static void put(Bounds &of, int a, float centre) { of.min[a] = centre - 0.5f, of.max[a] = centre + 0.5f; }
    void advance() {
        for (Bounds &of : bounds) {
            for (int a = 0; a < 3; a++) {
                float to = of.min[a] + 0.5f + (2 * unit() - 1) * STEP;
                put(of, a, std::min(std::max(to, 0.0f), edge));
            }
        }
    }
    static constexpr float STEP = 0.05f;
};

double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int bench() {
    const std::size_t n = 10000, frames = 400, warm_up = 100;
    Uniform scene(n);
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    std::vector<btBroadphaseProxy *> proxies;
    for (const Bounds &of : scene.bounds) {
        proxies.push_back(broadphase.createProxy(of.min, of.max, BOX_SHAPE_PROXYTYPE, nullptr, 1, 1, &dispatcher));
    }
    // Its best tree to begin with, rather than one of insertions.
    broadphase.optimize();
    sw_options one_thread = {};
    one_thread.threads = 1;
    sapwise::Space alone(one_thread), usual;
    std::vector<sapwise::Handle> of_alone(n), of_usual(n);
    alone.insert(boxes(scene.bounds), of_alone);
    usual.insert(boxes(scene.bounds), of_usual);
    auto update = [&](sapwise::Space &space, std::vector<sapwise::Handle> &handles) {
        space.set(handles, boxes(scene.bounds));
        space.update();
    };
    std::vector<double> times[3];
    for (std::size_t frame = 0; frame < warm_up + frames; frame++) {
        scene.advance();
        for (std::size_t k = 0; k < 3; k++) {
            std::size_t who = (frame + k) % 3;
            double began = seconds();
            if (who == 0) {
                for (std::size_t id = 0; id < n; id++) {
                    broadphase.setAabb(proxies[id], scene.bounds[id].min, scene.bounds[id].max, &dispatcher);
                }
                broadphase.calculateOverlappingPairs(&dispatcher);
            } else {
                who == 1 ? update(alone, of_alone) : update(usual, of_usual);
            }
            if (frame >= warm_up) times[who].push_back(seconds() - began);
        }
        if (alone.pairs().size() != usual.pairs().size()) throw std::runtime_error("the spaces differ");
    }
    const char *names[3] = {"bullet", "sapwise@1", "sapwise"};
    std::printf("objects,contestant,median_ms,quartile_1_ms,quartile_3_ms,frames,bullet_over\n");
    double median = 0;
    for (std::size_t who = 0; who < 3; who++) {
        std::sort(times[who].begin(), times[who].end());
        auto at = [&](double share) { return 1000 * times[who][static_cast<std::size_t>(share * (frames - 1))]; };
        median = who == 0 ? at(0.5) : median;
        std::printf("%zu,%s,%.4f,%.4f,%.4f,%zu,%.2f\n", n, names[who], at(0.5), at(0.25), at(0.75), frames,
            median / at(0.5));
    }
    for (btBroadphaseProxy *proxy : proxies) broadphase.destroyProxy(proxy, &dispatcher);
    return 0;
}

} // namespace

int main(int argc, char **argv) {
    try {
        if (argc > 1 && std::strcmp(argv[1], "--bench") == 0) return bench();
        return compare(argc > 1 ? std::stoul(argv[1]) : 400);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "sapwise: %s\n", error.what());
        return 1;
    }
}
