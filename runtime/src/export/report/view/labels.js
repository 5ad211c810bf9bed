// Labels: places of the surface with their figures, beside the view and in a table that is printed.
class Labels {
  constructor(overlay, rows, changed) {
    Object.assign(this, { overlay, rows, changed, list: [], seen: new Map() });
    for (const label of JSON.parse(element('labels').textContent)) this.list.push(label);
  }

  add(label) {
    if (this.list.some(other => other.column === label.column && other.row === label.row)) return;
    this.list.push(label);
    this.show();
    this.changed();
  }

  remove(label) {
    this.list = this.list.filter(other => other !== label);
    this.show();
    this.changed();
  }

  // The rows of the table.
  show() {
    this.rows.replaceChildren(...this.list.map((label, i) => {
      const row = document.createElement('tr'), part = scene.parts[label.part];
      const cell = (text, kind = 'td') => {
        const made = document.createElement(kind);
        if (kind === 'th') made.scope = 'row';
        made.textContent = text;
        row.append(made);
        return made;
      };
      cell(String(i + 1), 'th');
      cell(part.name).className = 'text';
      const uv = coordinates(label);
      cell(uv ? uv[0].toFixed(4) : '');
      cell(uv ? uv[1].toFixed(4) : '');
      cell(deviationText(label));
      cell(part.level === null ? '' : `\u00b1${lengthText(part.level)}`);
      cell(part.explained || '').className = 'text';
      cell(part.declared || '').className = 'text';
      const removal = document.createElement('button');
      removal.type = 'button';
      removal.textContent = 'Remove';
      removal.setAttribute('aria-label', `Remove label ${i + 1}`);
      removal.addEventListener('click', () => this.remove(label));
      cell('').append(removal);
      row.lastChild.className = 'screen';
      return row;
    }));
  }

  // Puts the labels at their places in the picture; those that something hides are faint.
  place(drawing, camera, settings) {
    const { clientWidth: width, clientHeight: height } = drawing.canvas, ratio = drawing.canvas.width / width;
    const nodes = [], taken = [];
    const shown = this.list.filter(label => !settings.hidden.has(label.part));
    const points = shown.map(label => {
      const place = label.place.map((share, k) => (2 * share - 1) * scene.halfSize[k]);
      const [x, y] = camera.project(place, drawing.aspect);
      return [x * width, y * height];
    });
    const found = drawing.seen(camera, settings, points.map(([x, y]) => [x * ratio, y * ratio]));
    shown.forEach((label, i) => {
      const [x, y] = points[i];
      if (x < 0 || y < 0 || x > width || y > height) return;
      const size = k => 2 * scene.halfSize[k] * (found[i] ? found[i].place[k] - label.place[k] : 1);
      const isSeen = found[i] && Math.hypot(size(0), size(1), size(2)) < 0.03 * camera.radius;
      const node = document.createElement('span');
      node.className = isSeen ? 'label' : 'label faint';
      node.textContent = `${this.list.indexOf(label) + 1}: ${deviationText(label)}`;
      let top = y - 10;
      while (taken.some(([left, other]) => Math.abs(left - x) < 90 && Math.abs(other - top) < 18)) top += 18;
      taken.push([x, top]);
      // In shares of the picture, which has another size on paper.
      const share = (part, whole) => `${100 * part / whole}%`;
      if (x > width - 100) node.classList.add('before');
      node.style.left = share(x, width);
      node.style.top = share(Math.min(top, height - 20), height);
      const dot = document.createElement('span');
      dot.className = isSeen ? 'place' : 'place faint';
      dot.style.left = share(x, width);
      dot.style.top = share(y, height);
      nodes.push(dot, node);
    });
    this.overlay.replaceChildren(...nodes);
  }
}

// u and v of a texel; null where the surface has none.
function coordinates({ part, column, row }) {
  const { uv } = scene.parts[part];
  if (!uv) return null;
  const [s, t] = [(column + 0.5) / scene.width, 1 - (row + 0.5) / scene.height];
  return uv.map(([c, alongS, alongT]) => Math.min(Math.max(c + alongS * s + alongT * t, 0), 1));
}

const CLASS_NAMES = ['no data', 'a closed hole', 'inside of the model', 'the scan shows empty space', 'ambiguous'];

// A length in millimetres with the digits that the data of the page have.
const DECIMALS = Math.min(Math.max(Math.ceil(-Math.log10(scene.step / 2)), 0), 12);
const lengthText = value => value.toFixed(DECIMALS);

// The deviation as it was measured where that is in the page, otherwise as the texels have it.
function deviationText({ steps, kind, distance }) {
  if (kind !== 1) return CLASS_NAMES[kind - 2] || 'no data';
  const value = distance ?? steps * scene.step;
  return `${value < 0 ? '\u2212' : '+'}${lengthText(Math.abs(value))} mm`;
}
