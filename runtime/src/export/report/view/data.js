// The data of the page: unpacked, and the map of the deviations drawn. pack.rs, surface.rs and cloud.rs have the other
// direction.
'use strict';

// The page as it came: labels are saved into it.
const asItCame = `<!DOCTYPE html>\n${document.documentElement.outerHTML}`;
const element = id => document.getElementById(id);
const scene = JSON.parse(element('scene').textContent);

// What went wrong, in words, where the reader looks for what is missing.
function failed(what, error) {
  const reason = error && error.message ? ` (${error.message})` : '';
  for (const place of document.querySelectorAll(what)) {
    place.textContent = place.dataset.failure + reason;
    place.classList.add('failure');
    place.hidden = false;
  }
}

async function unpacked(id) {
  if (typeof DecompressionStream === 'undefined') throw new Error('this browser cannot decompress data; it is older than 2023');
  const packed = Uint8Array.from(atob(element(id).textContent), c => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Reads planes of bytes one after the other.
function planes(bytes) {
  let at = 0;
  const plane = n => {
    if (at + n > bytes.length) throw new Error('the data of the page is cut off');
    at += n;
    return bytes.subarray(at - n, at);
  };
  const numbers = (n, width) => {
    const found = new Int32Array(n);
    for (let byte = 0; byte < width; byte++) plane(n).forEach((b, i) => { found[i] |= b << (8 * byte); });
    for (let i = 0; i < n; i++) found[i] = (found[i] >>> 1) ^ -(found[i] & 1);
    return found;
  };
  const smooth = n => {
    const found = new Uint16Array(n);
    numbers(n, 2).forEach((d, i) => { found[i] = d + 2 * (found[i - 1] ?? 0) - (found[i - 2] ?? 0); });
    return found;
  };
  return { plane, numbers, smooth };
}

// Positions with a fourth number that is not used, texture coordinates, normals with a fourth, indices.
function readMesh(bytes) {
  const [n, triangles, from] = [scene.vertices, scene.triangles, planes(bytes)];
  const positions = new Uint16Array(4 * n), places = new Uint16Array(2 * n), normals = new Int8Array(4 * n);
  for (let k = 0; k < 3; k++) from.smooth(n).forEach((value, i) => { positions[4 * i + k] = value; });
  for (let k = 0; k < 2; k++) from.smooth(n).forEach((value, i) => { places[2 * i + k] = value; });
  for (let k = 0; k < 3; k++) {
    let sum = 0;
    from.plane(n).forEach((value, i) => { sum += value; normals[4 * i + k] = sum; });
  }
  const indices = new Uint32Array(3 * triangles);
  for (let k = 0; k < 3; k++) {
    let sum = 0;
    from.numbers(triangles, 4).forEach((value, i) => { sum += value; indices[3 * i + k] = sum; });
  }
  return { positions, places, normals, indices };
}

// Points of the scan: positions with a fourth number that is not used.
function readCloud(bytes) {
  const n = scene.scan.points, from = planes(bytes), positions = new Uint16Array(4 * n);
  for (let k = 0; k < 3; k++) {
    let sum = 0;
    from.numbers(n, 2).forEach((value, i) => { sum += value; positions[4 * i + k] = sum; });
  }
  return positions;
}

// Texels beside a chart that its triangles may touch.
const BESIDE = 1;

// For each texel its deviation in steps, and its class.
function readTexels(bytes) {
  const { width, height } = scene, from = planes(bytes);
  const classes = from.plane(width * height);
  const differences = from.numbers(classes.reduce((n, c) => n + (c === 1), 0), 2);
  const texels = new Int16Array(2 * width * height);
  const known = (i, inside) => inside && classes[i] === 1;
  for (let i = 0, k = 0; i < width * height; i++) {
    texels[2 * i + 1] = classes[i];
    if (classes[i] !== 1) continue;
    const left = i % width > 0, above = i >= width, at = j => texels[2 * j];
    let expected = 0;
    if (known(i - 1, left) && known(i - width, above) && known(i - width - 1, left && above)) {
      expected = at(i - 1) + at(i - width) - at(i - width - 1);
    } else if (known(i - 1, left)) expected = at(i - 1);
    else if (known(i - width, above)) expected = at(i - width);
    texels[2 * i] = expected + differences[k++];
  }
  return texels;
}

// The texel of a chart that is nearest to one, which may lie beside all charts by rounding.
function nearestCharted(texels, column, row) {
  let nearest = [column, row], least = Infinity;
  for (let dy = -BESIDE; dy <= BESIDE; dy++) {
    for (let dx = -BESIDE; dx <= BESIDE; dx++) {
      const [x, y] = [column + dx, row + dy], distance = dx * dx + dy * dy;
      if (x < 0 || y < 0 || x >= scene.width || y >= scene.height || distance >= least) continue;
      if (texels[2 * (y * scene.width + x) + 1] !== 0) [nearest, least] = [[x, y], distance];
    }
  }
  return nearest;
}

// The texels with those beside the charts like their neighbours: corners of triangles lie on the borders of charts.
function widened(texels) {
  const wide = texels.slice(), { width, height } = scene;
  for (let y = 0, i = 0; y < height; y++) {
    for (let x = 0; x < width; x++, i++) {
      if (texels[2 * i + 1] !== 0) continue;
      const [column, row] = nearestCharted(texels, x, y), at = 2 * (row * width + column);
      [wide[2 * i], wide[2 * i + 1]] = [texels[at], texels[at + 1]];
    }
  }
  return wide;
}

// The place of a deviation (millimetres) on the scale from -1 to 1. Within `neutral`, if there is such a range, it is 0,
// and beyond there are `steps` up to `colourRange`, if there are any; scale.rs says the same.
function placeOnScale(deviation, { colourRange, neutral, steps }) {
  if (!neutral) return Math.min(Math.max(deviation / colourRange, -1), 1);
  const above = deviation > neutral[1], excess = above ? deviation - neutral[1] : neutral[0] - deviation;
  if (excess <= 0) return 0;
  if (!steps) return Math.min(Math.max(deviation / colourRange, -1), 1);
  const width = Math.max(colourRange - Math.max(...neutral.map(Math.abs)), 1e-9) / steps;
  return (above ? 1 : -1) * Math.min(Math.max(Math.ceil(excess / width - 1e-9), 1), steps) / steps;
}

// The colour of a deviation in steps of the data, as three bytes.
function colourOf(steps, scale = scene) {
  const last = scene.scale.length - 1, place = (placeOnScale(steps * scene.step, scale) + 1) / 2 * last;
  const below = Math.min(Math.floor(place), last - 1), share = place - below;
  return scene.scale[below].map((c, k) => Math.round(c * (1 - share) + scene.scale[below + 1][k] * share));
}

function drawMap(texels) {
  const canvas = element('map');
  [canvas.width, canvas.height] = [scene.width, scene.height];
  const context = canvas.getContext('2d'), image = context.createImageData(scene.width, scene.height);
  const colours = new Map(), stripes = Math.max(Math.floor(scene.width / 85), 6);
  for (let i = 0; i < scene.width * scene.height; i++) {
    const [steps, kind] = [texels[2 * i], texels[2 * i + 1]];
    if (kind === 0) continue;
    let colour = kind > 1 ? scene.classes[kind - 2] : colours.get(steps);
    if (!colour) colours.set(steps, colour = colourOf(steps));
    // What has no data is not to pass for a deviation of zero.
    if (kind === 2 && (i % scene.width + Math.floor(i / scene.width)) % stripes >= stripes / 2) colour = colour.map(c => 0.55 * c);
    image.data.set(colour, 4 * i);
    image.data[4 * i + 3] = 255;
  }
  context.putImageData(image, 0, 0);
  nameParts(context);
}

// The names of the parts on their charts.
function nameParts(context) {
  context.textBaseline = 'middle';
  context.textAlign = 'center';
  for (const { text, at, extent, upwards } of scene.names) {
    const [wide, high] = upwards ? [extent[1], extent[0]] : extent;
    context.save();
    context.translate(at[0] + extent[0] / 2, at[1] + extent[1] / 2);
    if (upwards) context.rotate(-Math.PI / 2);
    context.fillStyle = '#26262a';
    context.fillRect(-wide / 2, -high / 2, wide, high);
    context.fillStyle = '#ebebeb';
    context.font = `${0.72 * high}px sans-serif`;
    context.fillText(text, 0, 0, 0.94 * wide);
    context.restore();
  }
}

const texelData = unpacked('texels').then(readTexels);
texelData.then(drawMap).catch(error => failed('.needs-data', error));
