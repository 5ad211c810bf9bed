// The camera: a turntable about the model's own z, which points upwards.
const STANDARD_VIEWS = {
  front: [0, 0], right: [Math.PI / 2, 0], back: [Math.PI, 0], left: [-Math.PI / 2, 0],
  top: [0, Math.PI / 2], below: [0, -Math.PI / 2],
};

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// A direction of the model's own frame, turned into the scan's.
const inScan = direction => scene.frame.map(row => dot(row, direction));

class Camera {
  constructor() {
    this.fieldOfView = 0.6;
    this.radius = Math.hypot(...scene.halfSize) || 1;
    this.reset();
  }

  // Azimuth and elevation (radians), zoom, and a shift in half heights of the view.
  reset() { Object.assign(this, { azimuth: 0.5, elevation: 0.45, zoom: 1.2, shift: [0, 0] }); }

  look(name) {
    [this.azimuth, this.elevation] = STANDARD_VIEWS[name];
    this.shift = [0, 0];
  }

  turn(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = Math.min(Math.max(this.elevation + elevation, -Math.PI / 2), Math.PI / 2);
  }

  scale(factor) { this.zoom = Math.min(Math.max(this.zoom * factor, 0.2), 50); }

  // Moves the picture by a share of half its height.
  move(right, up) { this.shift = [this.shift[0] + right, this.shift[1] + up]; }

  get distance() { return 1.05 * this.radius / Math.sin(this.fieldOfView / 2) / this.zoom; }

  // Rows of the rotation from the scan's frame to the eye's: right, up, and towards the eye.
  get rows() {
    const { azimuth: a, elevation: e } = this;
    const right = [Math.cos(a), Math.sin(a), 0];
    const toward = [Math.cos(e) * Math.sin(a), -Math.cos(e) * Math.cos(a), Math.sin(e)];
    return [right, cross(toward, right), toward].map(inScan);
  }

  // By columns, for a picture of that aspect.
  matrices(aspect) {
    const { rows, distance, radius } = this;
    const half = distance * Math.tan(this.fieldOfView / 2);
    const view = [];
    for (let column = 0; column < 3; column++) view.push(...rows.map(row => row[column]), 0);
    view.push(this.shift[0] * half, this.shift[1] * half, -distance, 1);
    const near = Math.max(distance - 3 * radius, 0.01 * distance), far = distance + 3 * radius;
    const f = 1 / Math.tan(this.fieldOfView / 2) * Math.min(1, aspect), depth = 1 / (near - far);
    return { view, projection: [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (near + far) * depth, -1, 0, 0, 2 * near * far * depth, 0] };
  }

  // The place in the picture, from its left upper corner in shares of its sides, of a point from the model's centre.
  project(point, aspect) {
    const { view, projection } = this.matrices(aspect);
    const eye = [0, 1, 2].map(row => view[row] * point[0] + view[4 + row] * point[1] + view[8 + row] * point[2] + view[12 + row]);
    return [(1 - projection[0] * eye[0] / eye[2]) / 2, (1 + projection[5] * eye[1] / eye[2]) / 2];
  }

  // Shares of the picture's width that a millimetre at the model's centre has.
  widthOfMillimetre(aspect) {
    return this.matrices(aspect).projection[0] / this.distance / 2;
  }
}
