// The interactive view: what the reader does, and what is drawn then. Raw WebGL2, no library, no network.
(() => {
  const canvas = element('canvas'), camera = new Camera();
  let drawing, labels, section, texels;
  let asked = false, active = false;

  const isChecked = id => Boolean(element(id) && element(id).checked);

  const settings = () => {
    const axis = element('axis').value, on = axis !== '', k = on ? Number(axis) : 0;
    const height = on ? Number(element('height').value) / 100 * section.size[k] : 0;
    const normal = inScan([0, 1, 2].map(i => i === k ? 1 : 0));
    const tolerance = isChecked('neutral') ? scene.tolerance : null;
    return {
      mode: document.querySelector('input[name=mode]:checked').value,
      // Nothing, the deviations, or the scan's own colours.
      coloured: element('coloured').checked ? 1 : isChecked('scan-coloured') ? 2 : 0,
      exaggeration: Number(element('exaggeration').value),
      scan: element('scan-points').checked,
      hidden: new Set([...document.querySelectorAll('#parts input')].flatMap((box, part) => box.checked ? [] : [part])),
      colourRange: Math.max(Number(element('range').value), scene.step) || scene.colourRange,
      steps: element('bands').checked ? (tolerance ? scene.steps : 5) : 0,
      neutral: tolerance,
      axis: on ? k : null, height,
      plane: on ? [...normal, -height] : [0, 0, 0, -1],
    };
  };

  function redraw() {
    if (asked || !drawing) return;
    asked = true;
    requestAnimationFrame(() => { asked = false; show(); });
  }

  function show() {
    const now = settings();
    drawing.resize();
    canvas.parentElement.style.setProperty('--aspect', drawing.aspect);
    drawing.draw(camera, now);
    labels.place(drawing, camera, now);
    showScale();
    showAxes();
  }

  // A bar of a round length at the distance of the model's centre.
  function showScale() {
    const width = canvas.clientWidth, millimetre = camera.widthOfMillimetre(drawing.aspect) * width;
    const length = niceLength(0.25 * width / millimetre);
    element('scale-bar').style.width = `${100 * length * millimetre / width}%`;
    element('bar-length').textContent = `${length} mm at the centre`;
  }

  // The scan's axes, as they lie in the view.
  function showAxes() {
    const { rows } = camera, { namespaceURI } = element('axes');
    element('axes').replaceChildren(...[0, 1, 2].flatMap(k => {
      const [x, y] = [24 * rows[0][k], -24 * rows[1][k]];
      const line = document.createElementNS(namespaceURI, 'line');
      Object.entries({ x1: 32, y1: 32, x2: 32 + x, y2: 32 + y }).forEach(([name, value]) => line.setAttribute(name, value));
      const text = document.createElementNS(namespaceURI, 'text');
      Object.entries({ x: 32 + 1.25 * x, y: 36 + 1.25 * y, 'text-anchor': 'middle' }).forEach(([name, value]) => text.setAttribute(name, value));
      text.textContent = 'xyz'[k];
      return [line, text];
    }));
  }

  function showSection() {
    const now = settings(), figure = element('cut-figure');
    figure.hidden = now.axis === null;
    if (now.axis === null) return;
    const { factor } = section.draw(element('cut'), now.axis, now.height, now);
    element('cut-text').textContent = `Section across the model's own ${'xyz'[now.axis]} axis, ${now.height.toFixed(2)} mm from the middle of the model: its outline, and in colours the scan by its deviations, drawn ${factor} times as large.`;
  }

  // What is seen at a place of the canvas, in its pixels on the page.
  function pick(x, y) {
    const ratio = canvas.width / canvas.clientWidth, [found] = drawing.seen(camera, settings(), [[x * ratio, y * ratio]]);
    if (!found) { element('picked').textContent = 'Nothing is there.'; return; }
    const [column, row] = nearestCharted(texels, found.column, found.row), at = 2 * (row * scene.width + column);
    const label = { ...found, column, row, steps: texels[at], kind: texels[at + 1] };
    element('picked').textContent = described(label);
    labels.add(label);
  }

  function described(label) {
    const part = scene.parts[label.part], uv = coordinates(label);
    const parameters = uv ? ` at u = ${uv[0].toFixed(4)}, v = ${uv[1].toFixed(4)}` : '';
    const level = part.level === null ? '' : ` (level of detection \u00b1${lengthText(part.level)} mm)`;
    const place = label.place.map((share, k) => ((2 * share - 1) * scene.halfSize[k] + scene.centre[k]).toFixed(2)).join(', ');
    const rest = [part.explained, part.declared].filter(Boolean).join('; ');
    return `${part.name}${parameters}, (${place}) mm: ${deviationText(label)}${level}${rest ? '; ' + rest : ''}. Texel ${label.column}, ${label.row}.`;
  }

  function listen() {
    const pointers = new Map();
    let moved = 0;
    const spread = () => {
      const [a, b] = [...pointers.values()];
      return { size: Math.hypot(a.x - b.x, a.y - b.y), x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 };
    };
    const shift = (dx, dy) => camera.move(2 * dx / canvas.clientHeight, -2 * dy / canvas.clientHeight);
    // The page is scrolled over the view until it is clicked.
    const activate = on => {
      active = on;
      canvas.style.touchAction = on ? 'none' : 'pan-x pan-y';
      element('message').textContent = on
        ? 'Drag to turn, Shift or right button to move, wheel or pinch to zoom; click to label a place. Escape lets the page scroll again.'
        : 'Click or tap the view to turn it; until then the wheel and one finger scroll the page.';
    };
    activate(false);
    canvas.addEventListener('pointerdown', e => {
      moved = 0;
      if (e.pointerType === 'touch' && !active) return;
      canvas.setPointerCapture(e.pointerId);
      pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
    });
    canvas.addEventListener('pointermove', e => {
      const last = pointers.get(e.pointerId);
      if (!last) return;
      const before = pointers.size === 2 ? spread() : null;
      const [dx, dy] = [e.clientX - last.x, e.clientY - last.y];
      moved += Math.abs(dx) + Math.abs(dy);
      pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
      if (before) {
        const after = spread();
        if (before.size > 0 && after.size > 0) camera.scale(after.size / before.size);
        shift(after.x - before.x, after.y - before.y);
      } else if (e.shiftKey || e.buttons & 6) shift(dx, dy);
      else camera.turn(-0.008 * dx, 0.008 * dy);
      redraw();
    });
    for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, e => pointers.delete(e.pointerId));
    canvas.addEventListener('click', e => {
      if (!active) { activate(true); return; }
      const box = canvas.getBoundingClientRect();
      if (moved < 5) pick(e.clientX - box.left, e.clientY - box.top);
    });
    canvas.addEventListener('blur', () => activate(false));
    canvas.addEventListener('contextmenu', e => e.preventDefault());
    canvas.addEventListener('wheel', e => {
      if (!active) return;
      e.preventDefault();
      camera.scale(Math.exp(-0.0012 * e.deltaY));
      redraw();
    }, { passive: false });
    canvas.addEventListener('keydown', e => {
      const turn = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
      if (turn) camera.turn(...turn);
      else if (e.key === '+' || e.key === '-') camera.scale(e.key === '+' ? 1.15 : 1 / 1.15);
      else if (e.key === 'Enter') pick(canvas.clientWidth / 2, canvas.clientHeight / 2);
      else if (e.key === 'Escape') activate(false);
      else return;
      if (e.key !== 'Escape') e.preventDefault();
      redraw();
    });
    for (const button of document.querySelectorAll('#views button')) {
      button.addEventListener('click', () => {
        if (button.value === 'reset') camera.reset(); else camera.look(button.value);
        redraw();
      });
    }
    for (const input of document.querySelectorAll('.controls input, .controls select')) {
      input.addEventListener('input', () => {
        element('factor').textContent = element('exaggeration').value + '\u00d7';
        redraw();
        showSection();
      });
    }
    // One of both at most.
    const kinds = ['coloured', 'scan-coloured'].map(element).filter(Boolean);
    for (const kind of kinds) {
      kind.addEventListener('input', () => {
        if (kind.checked) kinds.filter(other => other !== kind).forEach(other => { other.checked = false; });
        redraw();
      });
    }
    element('save').addEventListener('click', save);
    new ResizeObserver(() => { redraw(); showSection(); }).observe(canvas);
    window.addEventListener('beforeprint', () => { show(); showSection(); });
  }

  // The page as it came, with the labels of now.
  function save() {
    const json = JSON.stringify(labels.list).replaceAll('<', '\\u003c');
    const page = asItCame.replace(/( id="labels">)[^<]*/, (_, tag) => tag + json);
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([page], { type: 'text/html' }));
    link.download = 'report.html';
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  // The scan's colours are those of a picture of the page, if it has any.
  const picture = element('scan-colours'), colours = picture && picture.decode().then(() => picture);
  const data = [unpacked('mesh').then(readMesh), texelData, unpacked('cloud').then(readCloud), colours];
  Promise.all(data).then(([mesh, found, points, colours]) => {
    texels = found;
    section = new Section(mesh, texels);
    drawing = new Drawing(canvas, mesh, texels, points, colours);
    labels = new Labels(element('overlay'), element('label-rows'), redraw);
    labels.show();
    listen();
    show();
    document.documentElement.dataset.view = 'shown';
  }).catch(error => failed('#message', error));
})();
