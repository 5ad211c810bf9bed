// The section: where a plane across one of the model's own axes cuts the model, and the scan by its deviations.
class Section {
  constructor(mesh, texels) {
    const { positions, places, normals, indices } = mesh, n = scene.vertices;
    Object.assign(this, { indices, corners: new Float32Array(3 * n), normals: new Float32Array(3 * n), deviations: new Float32Array(n) });
    // In the model's own frame, from its centre. Millimetres.
    const axes = [0, 1, 2].map(k => scene.frame.map(row => row[k]));
    for (let i = 0; i < n; i++) {
      const place = [0, 1, 2].map(k => (2 * positions[4 * i + k] / 65535 - 1) * scene.halfSize[k]);
      const normal = [0, 1, 2].map(k => normals[4 * i + k]), length = Math.hypot(...normal) || 1;
      axes.forEach((axis, k) => {
        this.corners[3 * i + k] = dot(axis, place);
        this.normals[3 * i + k] = dot(axis, normal) / length;
      });
      const column = Math.min(Math.floor(places[2 * i] / 65535 * scene.width), scene.width - 1);
      const row = Math.min(Math.max(Math.floor((1 - places[2 * i + 1] / 65535) * scene.height), 0), scene.height - 1);
      const at = 2 * (row * scene.width + column);
      this.deviations[i] = texels[at + 1] === 1 ? texels[at] * scene.step : NaN;
    }
    this.size = [0, 1, 2].map(k => {
      let most = 0;
      for (let i = k; i < this.corners.length; i += 3) most = Math.max(most, Math.abs(this.corners[i]));
      return most;
    });
  }

  // The line segments in which the plane cuts the parts that are shown: for both ends place, normal and deviation.
  cut(axis, height, hidden) {
    const { corners, indices } = this, segments = [];
    const side = i => corners[3 * i + axis] - height;
    const between = (a, b) => {
      const share = side(a) / (side(a) - side(b)), mix = (data, k) => data[3 * a + k] * (1 - share) + data[3 * b + k] * share;
      return {
        place: [0, 1, 2].map(k => mix(corners, k)), normal: [0, 1, 2].map(k => mix(this.normals, k)),
        deviation: this.deviations[a] * (1 - share) + this.deviations[b] * share,
      };
    };
    scene.parts.forEach(({ start, end }, part) => {
      if (hidden.has(part)) return;
      for (let t = start; t < end; t++) {
        const vertices = [0, 1, 2].map(k => indices[3 * t + k]), ends = [];
        vertices.forEach((a, k) => {
          const b = vertices[(k + 1) % 3];
          if (side(a) > 0 !== side(b) > 0) ends.push(between(a, b));
        });
        if (ends.length === 2) segments.push(ends);
      }
    });
    return segments;
  }

  // Draws the cut; deviations are enlarged, so that the largest of the colour scale is a twentieth of the picture.
  draw(canvas, axis, height, settings) {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), width = canvas.clientWidth || 600;
    const [right, up] = [[1, 2], [0, 2], [0, 1]][axis];
    const scale = 0.42 * width / Math.max(this.size[right], this.size[up], 1e-9) * Math.min(1, 1);
    const tall = Math.min(Math.max(2.4 * scale * this.size[up], 160), width);
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(tall * ratio)];
    canvas.style.height = `${tall}px`;
    const context = canvas.getContext('2d');
    context.scale(ratio, ratio);
    const fit = Math.min(scale, 0.42 * tall / Math.max(this.size[up], 1e-9));
    const factor = rounded(Math.max(0.05 * width / fit / settings.colourRange, 1));
    const place = ({ place, normal }, by) => [
      width / 2 + fit * (place[right] + by * normal[right]), tall / 2 - fit * (place[up] + by * normal[up]),
    ];
    const line = (from, to, colour, thickness) => {
      context.strokeStyle = colour;
      context.lineWidth = thickness;
      context.beginPath();
      context.moveTo(...from);
      context.lineTo(...to);
      context.stroke();
    };
    const segments = this.cut(axis, height, settings.hidden), ink = getComputedStyle(canvas).color;
    for (const [a, b] of segments) line(place(a, 0), place(b, 0), ink, 1.5);
    for (const [a, b] of segments) {
      if (Number.isNaN(a.deviation) || Number.isNaN(b.deviation)) continue;
      const colour = `rgb(${colourOf(a.deviation / scene.step, settings)})`, [from, to] = [a, b].map(end => place(end, factor * end.deviation));
      line(place(a, 0), from, colour, 0.7);
      line(from, to, colour, 2);
    }
    const bar = niceLength(0.2 * width / fit);
    line([10, tall - 10], [10 + bar * fit, tall - 10], ink, 2);
    context.fillStyle = ink;
    context.font = '12px sans-serif';
    context.fillText(`${bar} mm`, 14 + bar * fit, tall - 6);
    return { factor, segments: segments.length };
  }
}

// A number of one digit (1, 2 or 5) that is not larger.
function niceLength(most) {
  const power = 10 ** Math.floor(Math.log10(most)), digit = most / power;
  return Number(((digit >= 5 ? 5 : digit >= 2 ? 2 : 1) * power).toPrecision(1));
}

const rounded = factor => factor < 2 ? 1 : niceLength(factor);
