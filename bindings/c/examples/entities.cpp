// The loop of an engine in C++17: entities by slot, contacts that begin and end, a removal, and queries. Prints "ok".
#include <sapwise.hpp>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

struct Entity {
    std::string name;
    sapwise::Box box;
    sapwise::Handle handle;
};

class World {
public:
    sapwise::Handle add(const char *name, const sapwise::Box &box, const sapwise::Body &body = {}) {
        sapwise::Handle handle = space.insert(box, body);
        if (entities.size() <= handle >> 32) entities.resize((handle >> 32) + 1);
        of(handle) = {name, box, handle};
        return handle;
    }
    // The entity of a handle. That of a removed body stays until the first insertion after the next update.
    Entity &of(sapwise::Handle handle) { return entities[handle >> 32]; }
    void move(sapwise::Handle handle, float x) {
        Entity &entity = of(handle);
        entity.box.min[0] += x;
        entity.box.max[0] += x;
        space.set(handle, entity.box);
    }
    // Returns what has begun and ended, as a text.
    std::string update() {
        space.update();
        std::string text;
        for (const sapwise::Pair &pair : space.begun()) text += "+" + of(pair.a).name + "/" + of(pair.b).name + " ";
        for (const sapwise::Pair &pair : space.ended()) text += "-" + of(pair.a).name + "/" + of(pair.b).name + " ";
        return text;
    }

    sapwise::Space space;

private:
    std::vector<Entity> entities;
};

static void check(const std::string &found, const char *expected) {
    std::printf("%s\n", found.c_str());
    if (found != expected) std::exit(1);
}

int main() try {
    World world;
    world.add("wall", {{0, 0, 0}, {1, 4, 4}}, SW_FIXED);
    sapwise::Handle player = world.add("player", {{3, 1, 1}, {4, 2, 2}});
    sapwise::Handle crate = world.add("crate", {{3.5f, 1, 1}, {4.5f, 2, 2}});
    check(world.update(), "+player/crate ");
    world.move(player, -2);
    check(world.update(), "+wall/player -player/crate ");
    sapwise::Hit hit = world.space.first_hit({{9, 1.5f, 1.5f}, {-1, 0, 0}});
    check(world.of(hit.handle).name, "crate");
    world.space.remove(player);
    check(world.update(), "-wall/player ");
    sapwise::Body shot;
    shot.groups = 2;
    world.space.set_body(crate, shot);
    sapwise::Body by;
    by.masks = 1;
    auto only_wall = [&](sapwise::Handle found) { check(world.of(found).name, "wall"); };
    world.space.query_box({{0, 0, 0}, {9, 9, 9}}, only_wall, &by);
    std::printf("ok\n");
} catch (const sapwise::Error &error) {
    std::fprintf(stderr, "sapwise: %s\n", error.what());
    return 1;
}
