// The interactive view: raw WebGL2, no library, no network. data.js stands before it.
(() => {
  const canvas = element('canvas');
  const gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true });
  if (!gl) { failed('#message', new Error('this browser has no WebGL2')); return; }

  function program() {
    const made = gl.createProgram();
    for (const [type, id] of [[gl.VERTEX_SHADER, 'vertex-shader'], [gl.FRAGMENT_SHADER, 'fragment-shader']]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, element(id).textContent);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    ['position', 'normal', 'st'].forEach((name, i) => gl.bindAttribLocation(made, i, name));
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    return made;
  }

  function upload({ positions, places, normals, indices }) {
    const kinds = [[positions, 3, gl.UNSIGNED_SHORT, 8], [normals, 3, gl.BYTE, 4], [places, 2, gl.UNSIGNED_SHORT, 4]];
    kinds.forEach(([data, size, type, stride], i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.vertexAttribPointer(i, size, type, true, stride, 0);
      gl.enableVertexAttribArray(i);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  }

  function texture(texels) {
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RG16I, scene.width, scene.height, 0, gl.RG_INTEGER, gl.SHORT, texels);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
  }

  // Turntable around the model's own z: azimuth, elevation (radians), zoom, and a shift in half heights of the view.
  const start = { azimuth: 0.5, elevation: 0.45, zoom: 1.2, shift: [0, 0] };
  let camera = structuredClone(start);
  const fieldOfView = 0.6;

  function matrices() {
    const { azimuth: a, elevation: e } = camera;
    const radius = Math.hypot(...scene.halfSize);
    const distance = 1.05 * radius / Math.sin(fieldOfView / 2) / camera.zoom;
    // Right, up and towards the eye in the model's own frame; then turned into the scan's.
    const right = [Math.cos(a), Math.sin(a), 0];
    const toward = [Math.cos(e) * Math.sin(a), -Math.cos(e) * Math.cos(a), Math.sin(e)];
    const rows = [right, cross(toward, right), toward].map(row => scene.frame.map(f => f[0] * row[0] + f[1] * row[1] + f[2] * row[2]));
    const half = distance * Math.tan(fieldOfView / 2);
    const move = [camera.shift[0] * half, camera.shift[1] * half, -distance];
    const view = [];
    for (let column = 0; column < 3; column++) view.push(rows[0][column], rows[1][column], rows[2][column], 0);
    view.push(...move, 1);
    const near = Math.max(distance - 3 * radius, 0.01 * distance), far = distance + 3 * radius;
    const aspect = canvas.width / canvas.height, f = 1 / Math.tan(fieldOfView / 2) * Math.min(1, aspect);
    const depth = 1 / (near - far);
    return { view, projection: [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (near + far) * depth, -1, 0, 0, 2 * near * far * depth, 0] };
  }

  function cross(a, b) {
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  }

  let drawing = () => {};
  let asked = false;
  const draw = () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => { asked = false; drawing(); });
  };

  function begin(used) {
    const uniform = name => gl.getUniformLocation(used, name);
    const names = ['view', 'projection', 'halfSize', 'displaced', 'coloured', 'opacity', 'step', 'colourRange', 'exaggeration', 'classes'];
    const at = Object.fromEntries(names.map(name => [name, uniform(name)]));
    gl.useProgram(used);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.uniform3fv(at.halfSize, scene.halfSize);
    gl.uniform1f(at.step, scene.step);
    gl.uniform3fv(at.classes, scene.classes.flat().map(c => c / 255));
    gl.uniform1f(at.colourRange, scene.colourRange);
    const surface = (displaced, coloured, opacity) => {
      gl.uniform1f(at.displaced, displaced);
      gl.uniform1f(at.coloured, coloured);
      gl.uniform1f(at.opacity, opacity);
      gl.drawElements(gl.TRIANGLES, 3 * scene.triangles, gl.UNSIGNED_INT, 0);
    };
    drawing = () => {
      const ratio = Math.min(window.devicePixelRatio || 1, 2);
      const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
      if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
      gl.viewport(0, 0, width, height);
      gl.clearColor(0, 0, 0, 0);
      gl.disable(gl.BLEND);
      gl.depthMask(true);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      const { view, projection } = matrices();
      gl.uniformMatrix4fv(at.view, false, view);
      gl.uniformMatrix4fv(at.projection, false, projection);
      gl.uniform1f(at.exaggeration, Number(element('exaggeration').value));
      const mode = document.querySelector('input[name=mode]:checked').value;
      const coloured = element('coloured').checked ? 1 : 0;
      if (mode !== 'nominal') surface(1, coloured, 1);
      if (mode === 'nominal') surface(0, coloured, 1);
      if (mode === 'both') {
        gl.enable(gl.BLEND);
        gl.depthMask(false);
        surface(0, 0, 0.35);
      }
    };
    draw();
  }

  function listen() {
    const pointers = new Map();
    const spread = () => {
      const [a, b] = [...pointers.values()];
      return { size: Math.hypot(a.x - b.x, a.y - b.y), x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 };
    };
    const zoom = factor => { camera.zoom = Math.min(Math.max(camera.zoom * factor, 0.2), 50); };
    const shift = (dx, dy) => {
      camera.shift[0] += 2 * dx / canvas.clientHeight;
      camera.shift[1] -= 2 * dy / canvas.clientHeight;
    };
    canvas.addEventListener('pointerdown', e => {
      canvas.setPointerCapture(e.pointerId);
      pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
    });
    canvas.addEventListener('pointermove', e => {
      const last = pointers.get(e.pointerId);
      if (!last) return;
      const before = pointers.size === 2 ? spread() : null;
      const [dx, dy] = [e.clientX - last.x, e.clientY - last.y];
      pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
      if (before) {
        const after = spread();
        if (before.size > 0 && after.size > 0) zoom(after.size / before.size);
        shift(after.x - before.x, after.y - before.y);
      } else if (e.shiftKey || e.buttons & 6) {
        shift(dx, dy);
      } else {
        camera.azimuth -= 0.008 * dx;
        camera.elevation = Math.min(Math.max(camera.elevation + 0.008 * dy, -Math.PI / 2), Math.PI / 2);
      }
      draw();
    });
    for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, e => pointers.delete(e.pointerId));
    canvas.addEventListener('contextmenu', e => e.preventDefault());
    canvas.addEventListener('wheel', e => { e.preventDefault(); zoom(Math.exp(-0.0012 * e.deltaY)); draw(); }, { passive: false });
    canvas.addEventListener('keydown', e => {
      const turn = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
      if (turn) {
        e.preventDefault();
        camera.azimuth += turn[0];
        camera.elevation = Math.min(Math.max(camera.elevation + turn[1], -Math.PI / 2), Math.PI / 2);
      } else if (e.key === '+' || e.key === '-') zoom(e.key === '+' ? 1.15 : 1 / 1.15);
      else return;
      draw();
    });
    element('reset').addEventListener('click', () => { camera = structuredClone(start); draw(); });
    element('exaggeration').addEventListener('input', e => { element('factor').textContent = e.target.value + '\u00d7'; draw(); });
    element('coloured').addEventListener('change', draw);
    for (const input of document.querySelectorAll('input[name=mode]')) input.addEventListener('change', draw);
    new ResizeObserver(draw).observe(canvas);
    window.addEventListener('beforeprint', () => drawing());
  }

  Promise.all([unpacked('mesh').then(readMesh), texelData]).then(([mesh, texels]) => {
    const used = program();
    upload(mesh);
    texture(texels);
    listen();
    begin(used);
  }).catch(error => failed('#message', error));
})();
