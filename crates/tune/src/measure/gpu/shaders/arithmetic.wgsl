// Multiply-adds in registers. Eight independent chains of four lanes an invocation keep every pipeline full.

struct Shape {
    rounds: u32,
    // 0.5: a fixed point of the chains is 1, so that values neither vanish nor overflow. A constant would be folded.
    factor: f32,
}

@group(0) @binding(0) var<uniform> shape: Shape;
@group(0) @binding(1) var<storage, read_write> sink: array<u32>;

struct Chains {
    a: vec4<f32>,
    b: vec4<f32>,
    c: vec4<f32>,
    d: vec4<f32>,
    e: vec4<f32>,
    f: vec4<f32>,
    g: vec4<f32>,
    h: vec4<f32>,
}

// 32 multiply-adds.
fn advance(x: ptr<function, Chains>, m: vec4<f32>) {
    (*x).a = fma((*x).a, m, m);
    (*x).b = fma((*x).b, m, m);
    (*x).c = fma((*x).c, m, m);
    (*x).d = fma((*x).d, m, m);
    (*x).e = fma((*x).e, m, m);
    (*x).f = fma((*x).f, m, m);
    (*x).g = fma((*x).g, m, m);
    (*x).h = fma((*x).h, m, m);
}

// 256 multiply-adds a round.
fn chains(start: f32) -> f32 {
    let m = vec4<f32>(shape.factor);
    let s = vec4<f32>(start, start + 1.0, start + 2.0, start + 3.0);
    var x = Chains(s, s + 4.0, s + 8.0, s + 12.0, s + 16.0, s + 20.0, s + 24.0, s + 28.0);
    for (var r = 0u; r < shape.rounds; r++) {
        advance(&x, m);
        advance(&x, m);
        advance(&x, m);
        advance(&x, m);
        advance(&x, m);
        advance(&x, m);
        advance(&x, m);
        advance(&x, m);
    }
    let sum = x.a + x.b + x.c + x.d + x.e + x.f + x.g + x.h;
    return sum.x + sum.y + sum.z + sum.w;
}

@compute @workgroup_size(256)
fn multiply_add(@builtin(global_invocation_id) id: vec3<u32>) {
    // Never true, but the compiler can't know.
    if (chains(f32(id.x & 63u)) < -1.0) {
        sink[0] = id.x;
    }
}
