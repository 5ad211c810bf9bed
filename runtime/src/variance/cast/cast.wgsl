// One texel an invocation: the nearest hits along +normal and -normal ([VA] alg. 2), as bvh/ray.rs and bvh/block.rs do
// it, with the same padding of boxes and the same watertight test.

// obvhs's Bvh2Node. A leaf (count > 0) has block first / 4; an inner node's children are first and first + 1.
struct Node {
  low: vec3f,
  count: u32,
  high: vec3f,
  first: u32,
}

// Up to four triangles: corners[3 c + k] holds coordinate k of corner c of all four.
struct Block {
  corners: array<vec4f, 9>,
}

struct Ray {
  origin: vec3f,
  // 0 where there is no ray.
  present: f32,
  direction: vec3f,
  unused: f32,
}

struct Setup {
  half_extent: vec3f,
  max_distance: f32,
  tolerance: f32,
  count: u32,
  // 1 where only triangles count that face as the model does, 0 where all.
  facing: f32,
  // The least cosine between its normal and the model's.
  cosine: f32,
  // Nodes and blocks per binding.
  nodes_each: u32,
  blocks_each: u32,
  unused: vec2u,
}

@group(0) @binding(0) var<uniform> setup: Setup;
@group(0) @binding(1) var<storage, read> rays: array<Ray>;
@group(0) @binding(2) var<storage, read_write> distances: array<vec2f>;
// Nodes and blocks, as many bindings as they need, and node_at and corner_at, which find an element: bindings.rs adds
// them.

const FAR = 3.0e38;
const MISS = -1.0;
// MAX_DEPTH of the tree.
const STACK = 64;

// Axes permuted so that z is where the direction is largest; shear and scale turn the direction into (0, 0, 1).
struct Shear {
  axes: vec3u,
  origin: vec3f,
  shear: vec2f,
  scale: f32,
  // 1 / -1: hit only triangles whose normal goes with / against the ray; 0: any. Times direction.z.
  facing: f32,
}

fn make_shear(origin: vec3f, direction: vec3f, facing: f32) -> Shear {
  var z = 0u;
  if abs(direction.y) > abs(direction[z]) { z = 1u; }
  if abs(direction.z) > abs(direction[z]) { z = 2u; }
  let axes = vec3u((z + 1u) % 3u, (z + 2u) % 3u, z);
  let d = vec3f(direction[axes.x], direction[axes.y], direction[axes.z]);
  return Shear(axes, vec3f(origin[axes.x], origin[axes.y], origin[axes.z]), d.xy / d.z, 1.0 / d.z, facing * d.z);
}

// The difference of two products, or zero where rounding may have decided its sign: products may be fused with the
// subtraction here, which native code never does.
fn difference(p: vec4f, q: vec4f) -> vec4f {
  let d = p - q;
  return select(d, vec4f(0.0), abs(d) <= abs(p) * 0x1p-22);
}

// The nearest t in [t_min, t_max] at which a triangle of the block is hit, else FAR.
fn intersect(block: u32, ray: Shear, t_min: f32, t_max: f32) -> f32 {
  var x: array<vec4f, 3>;
  var y: array<vec4f, 3>;
  var z: array<vec4f, 3>;
  for (var c = 0u; c < 3u; c += 1u) {
    z[c] = corner_at(block, 3u * c + ray.axes.z) - ray.origin.z;
    x[c] = corner_at(block, 3u * c + ray.axes.x) - ray.origin.x - ray.shear.x * z[c];
    y[c] = corner_at(block, 3u * c + ray.axes.y) - ray.origin.y - ray.shear.y * z[c];
  }
  let u = difference(x[2] * y[1], y[2] * x[1]);
  let v = difference(x[0] * y[2], y[0] * x[2]);
  let w = difference(x[1] * y[0], y[1] * x[0]);
  let low = min(min(u, v), w);
  let high = max(max(u, v), w);
  let det = u + v + w;
  var slant = vec4f(0.0);
  if setup.cosine > 0.0 {
    let p = array(x[1] - x[0], y[1] - y[0], z[1] - z[0]);
    let q = array(x[2] - x[0], y[2] - y[0], z[2] - z[0]);
    // Of the edges before the shear, which moved x and y along z.
    let px = p[0] + ray.shear.x * p[2];
    let py = p[1] + ray.shear.y * p[2];
    let qx = q[0] + ray.shear.x * q[2];
    let qy = q[1] + ray.shear.y * q[2];
    let nx = py * q[2] - p[2] * qy;
    let ny = p[2] * qx - px * q[2];
    let nz = px * qy - py * qx;
    slant = setup.cosine * sqrt(nx * nx + ny * ny + nz * nz);
  }
  let faces = ray.facing * det + slant <= vec4f(0.0);
  let inside = ((low >= vec4f(0.0)) | (high <= vec4f(0.0))) & (det != vec4f(0.0)) & faces;
  if !any(inside) {
    return FAR;
  }
  let t = ray.scale * (u * z[0] + v * z[1] + w * z[2]) / det;
  let hit = inside & (t >= vec4f(t_min)) & (t <= vec4f(t_max));
  let near = select(vec4f(FAR), t, hit);
  return min(min(near.x, near.y), min(near.z, near.w));
}

struct Slabs {
  from_low: vec3f,
  from_high: vec3f,
  inverse: vec3f,
}

// Where the ray enters a node's box, at least t_min, if it does so before t_max; else FAR.
fn enter(node: Node, slabs: Slabs, t_min: f32, t_max: f32) -> f32 {
  let a = (node.low - slabs.from_low) * slabs.inverse;
  let b = (node.high - slabs.from_high) * slabs.inverse;
  let near = min(a, b);
  let far = max(a, b);
  let first = max(max(near.x, near.y), max(near.z, t_min));
  let last = min(min(far.x, far.y), min(far.z, t_max));
  return select(FAR, first, first <= last);
}

// What is within the tolerance of the origin is at it, in both directions.
fn distance_of(t: f32) -> f32 {
  return select(select(t, 0.0, t <= setup.tolerance), MISS, t == FAR);
}

fn nearest_hit(origin: vec3f, direction: vec3f, facing: f32) -> f32 {
  let reach = abs(origin) + setup.half_extent;
  let padding = max(max(max(reach.x, reach.y), reach.z) * 0x1p-19, 1.0e-30);
  let tiny = select(vec3f(1.0e-20), vec3f(-1.0e-20), direction < vec3f(0.0));
  let slabs = Slabs(
    origin + padding,
    origin - padding,
    1.0 / select(direction, tiny, abs(direction) < vec3f(1.0e-20)),
  );
  let ray = make_shear(origin, direction, facing);
  let t_min = -setup.tolerance;
  var t_max = setup.max_distance;
  var best = FAR;

  let root = node_at(0u);
  if root.count > 0u {
    best = intersect(0u, ray, t_min, t_max);
    return distance_of(best);
  }
  var stack_pair: array<u32, STACK>;
  var stack_t: array<f32, STACK>;
  var height = 0u;
  var pair = root.first;
  loop {
    var near = node_at(pair);
    var far = node_at(pair + 1u);
    var t_near = enter(near, slabs, t_min, t_max);
    var t_far = enter(far, slabs, t_min, t_max);
    if t_near > t_far {
      let node = near;
      near = far;
      far = node;
      let t = t_near;
      t_near = t_far;
      t_far = t;
    }
    pair = 0u;
    if t_near < FAR {
      if near.count > 0u {
        let t = intersect(near.first / 4u, ray, t_min, t_max);
        if t < FAR {
          best = t;
          t_max = t;
        }
      } else {
        pair = near.first;
      }
    }
    if t_far < FAR && t_far <= t_max {
      if far.count > 0u {
        let t = intersect(far.first / 4u, ray, t_min, t_max);
        if t < FAR {
          best = t;
          t_max = t;
        }
      } else if pair != 0u {
        stack_pair[height] = far.first;
        stack_t[height] = t_far;
        height += 1u;
      } else {
        pair = far.first;
      }
    }
    while pair == 0u && height > 0u {
      height -= 1u;
      if stack_t[height] <= t_max {
        pair = stack_pair[height];
      }
    }
    if pair == 0u {
      break;
    }
  }
  return distance_of(best);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
  let i = id.x;
  if i >= setup.count {
    return;
  }
  var found = vec2f(MISS);
  if rays[i].present != 0.0 {
    found = vec2f(
      nearest_hit(rays[i].origin, rays[i].direction, setup.facing),
      nearest_hit(rays[i].origin, -rays[i].direction, -setup.facing),
    );
  }
  distances[i] = found;
}
