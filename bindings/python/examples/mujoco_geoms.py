"""Candidates for contacts of MuJoCo's geoms in each step, against MuJoCo's own broad phase and a loop in Python.

    python bindings/python/examples/mujoco_geoms.py [GEOMS]

Free bodies of three geoms each are shaken above a plane. Every contact of MuJoCo must be among the candidates. Like
MuJoCo it takes geoms of one body, and of the world's body, as no pair. Times are of the processor.
"""

import sys
import time

import mujoco
import numpy as np

import sapwise

SHAPES = ['type="box" size="0.2 0.12 0.1"', 'type="capsule" size="0.08 0.2" pos="0.2 0 0"', 'type="sphere" size="0.15"']


def scene(geoms, seed=1):
    rng = np.random.default_rng(seed)
    bodies = geoms // len(SHAPES)
    edge = bodies ** (1 / 3)
    places = rng.uniform(0, 0.8 * edge, (bodies, 3)) + [0, 0, 0.2]
    turns = rng.uniform(0, 360, (bodies, 3))
    inner = "".join(f"<geom {shape}/>" for shape in SHAPES)
    text = lambda numbers: " ".join(f"{number:.4f}" for number in numbers)
    each = (f'<body pos="{text(p)}" euler="{text(t)}"><freejoint/>{inner}</body>' for p, t in zip(places, turns))
    ground = '<geom type="plane" size="0 0 1"/>'
    return mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{ground}{''.join(each)}</worldbody></mujoco>")


def bounds(model, data):
    """Boxes of all geoms in the world, shape (n, 6)."""
    # Axes first, so that NumPy runs along the geoms.
    turn = np.ascontiguousarray(data.geom_xmat.T).reshape(3, 3, -1)
    shift, size = np.split(np.ascontiguousarray(model.geom_aabb.T), 2)
    centre = data.geom_xpos.T + (turn * shift).sum(axis=1)
    half = (np.abs(turn) * size).sum(axis=1) + model.geom_margin
    boxes = np.concatenate([centre - half, centre + half]).astype(np.float32).T.copy()
    # The plane lies flat: all below its height.
    plane = model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
    boxes[plane] = np.float32([-np.inf, -np.inf, -np.inf, np.inf, np.inf, 0])
    return boxes


def by_loop(boxes, body):
    """What people write, one row at a time."""
    found = []
    for i in range(len(boxes)):
        rest = boxes[i + 1 :]
        meets = ((boxes[i, :3] <= rest[:, 3:]) & (rest[:, :3] <= boxes[i, 3:])).all(axis=1) & (body[i + 1 :] != body[i])
        found += [(i, j) for j in np.flatnonzero(meets) + i + 1]
    return np.array(found, np.int64).reshape(-1, 2)


model = scene(int(sys.argv[1]) if len(sys.argv) > 1 else 5000)
data = mujoco.MjData(model)
body = model.body_weldid[model.geom_bodyid]
mujoco.set_mjcb_time(lambda: 1e3 * time.process_time())
timer = mujoco.mjtTimer.mjTIMER_COL_BROAD
rng = np.random.default_rng(2)
times = {"sapwise": [], "MuJoCo": [], "loop": []}
with sapwise.Space(measure=False) as space:
    mujoco.mj_kinematics(model, data)
    # Owner 0 is none.
    handles = space.insert(bounds(model, data), owner=body.astype(np.uint32) + 1, fixed=body == 0)
    for step in range(101):
        # At about 1 m/s, in MuJoCo's usual step of 2 ms.
        data.qpos.reshape(-1, 7)[:, :3] += rng.normal(0, 0.001, (len(data.qpos) // 7, 3))
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        data.timer[timer].duration = 0
        mujoco.mj_collision(model, data)
        own = data.timer[timer].duration
        began = time.process_time()
        boxes = bounds(model, data)
        space.set(handles[1:], boxes[1:])
        space.update()
        # Nothing was removed: the upper half of a handle is the position of its geom.
        pairs = space.pairs() >> np.uint64(32)
        times["sapwise"].append(1e3 * (time.process_time() - began))
        times["MuJoCo"].append(own)
        if step % 50 == 0:
            began = time.process_time()
            looped = by_loop(boxes, body)
            times["loop"].append(1e3 * (time.process_time() - began))
            assert {tuple(p) for p in pairs.tolist()} == {tuple(p) for p in looped.tolist()}
        contacts = np.sort(data.contact.geom, axis=1)
        assert {tuple(p) for p in contacts.tolist()} <= {tuple(p) for p in pairs.tolist()}
    ours, own, loop = (np.median(of[1:]) for of in times.values())
    print(f"MuJoCo: {model.ngeom} geoms, {len(pairs)} candidates, {data.ncon} contacts in the last of {step} steps")
    print(f"sapwise {ours:.2f} ms a step, boxes included, MuJoCo's broad phase {own:.2f} ms ({own / ours:.2f}×)")
    print(f"a loop in Python {loop:.0f} ms ({loop / ours:.0f}×), the same candidates")
