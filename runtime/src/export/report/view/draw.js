// Drawing with WebGL2: the surface, the scan's points, and the numbers of what is seen at a pixel.
class Drawing {
  constructor(canvas, mesh, texels, points, colours) {
    const gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error('this browser has no WebGL2');
    Object.assign(this, { canvas, gl });
    this.surface = this.program('surface', colours ? '#define SCAN_COLOURS\n' : '');
    this.numbers = this.program('surface', '#define NUMBERS\n');
    this.cloud = this.program('points', '');
    this.mesh = this.uploadMesh(mesh);
    this.points = this.uploadPoints(points);
    if (colours) this.uploadColours(colours);
    this.upload(texels);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  // A program of two shaders and the places of its uniforms.
  program(name, definitions) {
    const gl = this.gl, made = gl.createProgram();
    for (const [type, stage] of [[gl.VERTEX_SHADER, 'vertex'], [gl.FRAGMENT_SHADER, 'fragment']]) {
      const shader = gl.createShader(type), text = element(`${name}-${stage}`).textContent;
      gl.shaderSource(shader, text.replace('#version 300 es\n', '#version 300 es\n' + definitions));
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    ['position', 'normal', 'st'].forEach((input, i) => gl.bindAttribLocation(made, i, input));
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    const at = {};
    for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i++) {
      const { name: uniform } = gl.getActiveUniform(made, i);
      at[uniform.replace('[0]', '')] = gl.getUniformLocation(made, uniform);
    }
    return { made, at };
  }

  attribute(i, data, size, type, stride) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    gl.vertexAttribPointer(i, size, type, true, stride, 0);
    gl.enableVertexAttribArray(i);
  }

  uploadMesh({ positions, places, normals, indices }) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    this.attribute(0, positions, 3, gl.UNSIGNED_SHORT, 8);
    this.attribute(1, normals, 3, gl.BYTE, 4);
    this.attribute(2, places, 2, gl.UNSIGNED_SHORT, 4);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    return array;
  }

  uploadPoints(positions) {
    const array = this.gl.createVertexArray();
    this.gl.bindVertexArray(array);
    this.attribute(0, positions, 3, this.gl.UNSIGNED_SHORT, 8);
    return { array, count: positions.length / 4 };
  }

  upload(texels) {
    const gl = this.gl;
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RG16I, scene.width, scene.height, 0, gl.RG_INTEGER, gl.SHORT, widened(texels));
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
  }

  // The scan's colours at the texels, of which a pixel may have several.
  uploadColours(picture) {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, gl.RGB, gl.UNSIGNED_BYTE, picture);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    gl.activeTexture(gl.TEXTURE0);
  }

  get aspect() { return this.canvas.width / this.canvas.height; }

  // Makes the canvas as large as its place on the page, in the device's pixels.
  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), canvas = this.canvas;
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(x => Math.max(Math.round(x), 1));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  }

  use({ made, at }, camera, settings) {
    const gl = this.gl, { view, projection } = camera.matrices(this.aspect);
    gl.useProgram(made);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.uniformMatrix4fv(at.view, false, view);
    gl.uniformMatrix4fv(at.projection, false, projection);
    gl.uniform4fv(at.plane, settings.plane);
    const { halfSize, step, classes } = scene;
    if (at.halfSize) gl.uniform3fv(at.halfSize, halfSize);
    if (at.scanColours) gl.uniform1i(at.scanColours, 1);
    if (at.step) gl.uniform1f(at.step, step);
    if (at.classes) gl.uniform3fv(at.classes, classes.flat().map(c => c / 255));
    if (at.colourRange) gl.uniform1f(at.colourRange, settings.colourRange);
    if (at.bands) gl.uniform1f(at.bands, settings.steps);
    if (at.neutral) gl.uniform2fv(at.neutral, settings.neutral || [1, -1]);
    if (at.exaggeration) gl.uniform1f(at.exaggeration, settings.exaggeration);
  }

  // The parts that are shown, displaced to the scan or as they are.
  parts({ at }, settings, displaced, coloured, opacity) {
    const gl = this.gl;
    gl.bindVertexArray(this.mesh);
    gl.uniform1f(at.displaced, displaced);
    if (at.coloured) gl.uniform1f(at.coloured, coloured);
    if (at.opacity) gl.uniform1f(at.opacity, opacity);
    scene.parts.forEach(({ start, end }, part) => {
      if (settings.hidden.has(part)) return;
      if (at.part) gl.uniform1ui(at.part, part + 1);
      gl.drawElements(gl.TRIANGLES, 3 * (end - start), gl.UNSIGNED_INT, 12 * start);
    });
  }

  draw(camera, settings) {
    const gl = this.gl, { coloured } = settings;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.clearColor(0, 0, 0, 0);
    gl.disable(gl.BLEND);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (settings.scan) this.drawPoints(camera, settings);
    this.use(this.surface, camera, settings);
    if (settings.mode !== 'nominal') this.parts(this.surface, settings, 1, coloured, 1);
    if (settings.mode === 'nominal') this.parts(this.surface, settings, 0, coloured, 1);
    if (settings.mode === 'both') {
      gl.enable(gl.BLEND);
      gl.depthMask(false);
      this.parts(this.surface, settings, 0, 0, 0.35);
      gl.depthMask(true);
    }
  }

  drawPoints(camera, settings) {
    const gl = this.gl;
    this.use(this.cloud, camera, settings);
    gl.bindVertexArray(this.points.array);
    gl.uniform3fv(this.cloud.at.middle, scene.scan.middle);
    gl.uniform3fv(this.cloud.at.halfExtent, scene.scan.halfSize);
    gl.uniform1f(this.cloud.at.size, Math.max(1.5, this.canvas.height / 260));
    gl.drawArrays(gl.POINTS, 0, this.points.count);
  }

  // What is seen at pixels of the canvas (from its left upper corner): place on the model in shares of its box, part,
  // and texel; none where nothing is.
  seen(camera, settings, pixels) {
    const gl = this.gl, { width, height } = this.canvas;
    this.prepareNumbers(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.frame);
    gl.disable(gl.BLEND);
    gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferuiv(gl.COLOR, 1, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    this.use(this.numbers, camera, settings);
    this.parts(this.numbers, settings, settings.mode === 'nominal' ? 0 : 1, 0, 1);
    const read = (attachment, x, y) => {
      const found = new Uint32Array(4);
      gl.readBuffer(attachment);
      gl.readPixels(x, height - 1 - y, 1, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, found);
      return found;
    };
    const found = pixels.map(([x, y]) => {
      if (!(x >= 0 && y >= 0 && x < width && y < height)) return null;
      const [px, py] = [Math.floor(x), Math.floor(y)], where = read(gl.COLOR_ATTACHMENT0, px, py);
      if (where[3] === 0) return null;
      const [column, row] = read(gl.COLOR_ATTACHMENT1, px, py);
      return { place: [0, 1, 2].map(k => where[k] / 65535), part: where[3] - 1, column, row };
    });
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return found;
  }

  prepareNumbers(width, height) {
    const gl = this.gl;
    if (this.target && this.target.width === width && this.target.height === height) return;
    if (this.target) {
      this.target.buffers.forEach(buffer => gl.deleteRenderbuffer(buffer));
      gl.deleteFramebuffer(this.target.frame);
    }
    const frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    const kinds = [[gl.COLOR_ATTACHMENT0, gl.RGBA32UI], [gl.COLOR_ATTACHMENT1, gl.RGBA32UI], [gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT24]];
    const buffers = kinds.map(([attachment, format]) => {
      const buffer = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, attachment, gl.RENDERBUFFER, buffer);
      return buffer;
    });
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
    this.target = { frame, buffers, width, height };
  }
}
