// The network's clock: a row of frames for each node and the curves below, on one time axis.

const AXIS_PX = 24, RIGHT_PX = 64;
const FAR_BARS_PX = 5; // least width of a bar
const FRAMES_A_BAR = 8; // approximate number of frames per bar, so that a share of them is meaningful
const NEAR_PX = 4; // frames are drawn one by one if each has this width
const ROW_SHARES = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1];
const SPLIT = 0.36; // part of a row's height for the losses

class Dock {
  constructor(canvas, record, frames, seek) {
    Object.assign(this, {canvas, record, frames, seek});
    this.now = 0;
    this.from = 0;
    this.span = record.end_s;
    this.shares = this.rowShares();
    gestures(canvas, {
      drag: dx => this.pan(dx),
      pan: dx => this.pan(dx),
      zoom: (factor, clientX) => this.zoom(factor, this.time(clientX)),
      click: event => seek(this.time(event.clientX)),
      hover: event => this.hover?.(this.text(event)),
    });
    canvas.addEventListener("dblclick", () => this.whole());
    canvas.addEventListener("pointerleave", () => this.hover?.(""));
    new ResizeObserver(() => this.draw()).observe(canvas);
    this.draw();
  }

  // The visible time window.

  get left() { return this.canvas.clientWidth < 600 ? 76 : 168; }
  get width() { return Math.max(this.canvas.clientWidth - this.left - RIGHT_PX, 10); }
  get row() { return clamp(Math.floor(0.18 * innerHeight / this.record.nodes.length), 8, clamp(0.045 * innerHeight, 32, 48)); }
  get curves() { return clamp(0.13 * innerHeight, 80, 150); }
  get rows() { return this.row * this.record.nodes.length; }

  x(t) { return this.left + (t - this.from) / this.span * this.width; }

  time(clientX) {
    const x = clientX - this.canvas.getBoundingClientRect().left;
    return clamp(this.from + (x - this.left) / this.width * this.span, 0, this.record.end_s);
  }

  window(from, span) {
    this.span = clamp(span, Math.min(1e-5, this.record.end_s), this.record.end_s);
    this.from = clamp(from, 0, this.record.end_s - this.span);
    this.draw();
  }

  whole() { this.window(0, this.record.end_s); }
  pan(dx) { this.window(this.from - dx / this.width * this.span, this.span); }
  zoom(factor, around) {
    const span = this.span / factor;
    this.window(around - (around - this.from) * clamp(span / this.span, 0, this.record.end_s / this.span), span);
  }

  // Set the clock; a window that contains it moves on with it.
  setNow(t, moved) {
    this.now = t;
    if (moved && (t < this.from || t > this.from + 0.9 * this.span))
      this.from = clamp(t - 0.15 * this.span, 0, this.record.end_s - this.span);
    this.draw();
  }

  // Frames of a node: the number that start in [from, to), their air time, and the number of losses.

  first(node, t) {
    const {start, first} = this.frames;
    let low = first[node], high = first[node + 1];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (start[middle] < t) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  between(node, from, to) {
    const {air, lost} = this.frames, i = this.first(node, from), j = this.first(node, to);
    return {i, j, count: j - i, air_s: air[j] - air[i], lost: lost[j] - lost[i]};
  }

  // Return the shares that a row's full height stands for, from the whole run.
  rowShares() {
    const parts = 100, step = this.record.end_s / parts;
    let air = 0, lost = 0;
    for (let node = 0; node < this.record.nodes.length; node++)
      for (let part = 0; part < parts; part++) {
        const some = this.between(node, part * step, (part + 1) * step);
        air = Math.max(air, some.air_s / step);
        if (some.count >= FRAMES_A_BAR) lost = Math.max(lost, some.lost / some.count);
      }
    const round = share => ROW_SHARES.find(each => each >= share) ?? 1;
    return {air: round(air), lost: round(lost)};
  }

  near() {
    return this.record.nodes.every((_, node) =>
      this.between(node, this.from, this.from + this.span).count * NEAR_PX <= this.width);
  }

  // Drawing.

  draw() {
    this.asked ??= requestAnimationFrame(() => {
      this.asked = null;
      this.paint();
    });
  }

  paint() {
    const {canvas} = this, ratio = devicePixelRatio || 1;
    const height = this.rows + this.curves + AXIS_PX + 8;
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(height * ratio);
    const pen = this.pen = canvas.getContext("2d");
    const style = getComputedStyle(canvas);
    this.color = name => style.getPropertyValue(`--${name}`).trim();
    pen.scale(ratio, ratio);
    pen.textBaseline = "middle";
    const near = this.near();
    this.record.nodes.forEach((node, index) => this.paintRow(node, index, near));
    this.paintCurves(this.rows + 8);
    this.paintAxis(height - AXIS_PX);
    this.paintNow(height - AXIS_PX);
    this.scaleText?.(near ? "one box per frame; lost frames show the cause" :
      `full row: green ${percent(this.shares.air)} of the time on the air, ` +
      `red ${percent(this.shares.lost)} of the frames lost`);
  }

  font(size, weight = 400) { this.pen.font = `${weight} ${size}px system-ui, sans-serif`; }

  inside(draw) {
    this.pen.save();
    this.pen.beginPath();
    this.pen.rect(this.left, 0, this.width, 1e4);
    this.pen.clip();
    draw();
    this.pen.restore();
  }

  paintRow(node, index, near) {
    const {pen, row} = this, top = index * row, some = this.between(index, this.from, this.from + this.span);
    pen.fillStyle = this.color(index % 2 ? "paper" : "stripe");
    pen.fillRect(this.left, top, this.width, row);
    pen.textAlign = "left";
    pen.fillStyle = this.color("ink");
    const two = row >= 30;
    if (row >= 12) {
      this.font(two ? 15 : 12, 600);
      pen.fillText(node.name, 4, top + (two ? 0.3 : 0.5) * row, this.left - 10);
    }
    if (two) {
      this.font(12);
      pen.fillStyle = this.color("soft");
      const lost = some.count ? `${percent(some.lost / some.count)} lost` : "silent";
      pen.fillText(this.left > 100 && some.count ? `${counted(some.count)}, ${lost}` : lost, 4, top + 0.7 * row, this.left - 10);
    }
    this.inside(() => near ? this.paintFrames(index, top) : this.paintRates(index, top));
  }

  paintRates(index, top) {
    const {pen, row} = this, all = this.between(index, this.from, this.from + this.span);
    const wanted = Math.max(FAR_BARS_PX / this.width, FRAMES_A_BAR / Math.max(all.count, 1)) * this.span;
    const step = 2 ** Math.ceil(Math.log2(wanted)); // the bars do not depend on the start of the window
    const [lane, base] = [SPLIT * (row - 3), top + row - 1];
    for (let t = Math.floor(this.from / step) * step; t < this.from + this.span; t += step) {
      const some = this.between(index, t, t + step);
      if (!some.count) continue;
      const x = this.x(t), width = Math.max(this.x(t + step) - x - 0.5, 1);
      const air = Math.min(some.air_s / step / this.shares.air, 1) * (row - 3 - lane);
      pen.fillStyle = this.color("delivered");
      pen.fillRect(x, base - air, width, air);
      if (!some.lost) continue;
      const lost = Math.max(Math.min(some.lost / some.count / this.shares.lost, 1) * lane, 1.5);
      pen.fillStyle = this.hatch();
      pen.fillRect(x, top + 1 + lane - lost, width, lost);
    }
  }

  paintFrames(index, top) {
    const {pen, row} = this, {start, end, cause} = this.frames;
    const last = this.first(index, this.from + this.span);
    const one = Math.max(this.first(index, this.from) - 1, this.frames.first[index]);
    for (let i = one; i < last; i++) {
      const x = this.x(start[i]), width = Math.max(this.x(end[i]) - x, 1.5);
      if (!cause[i]) {
        pen.fillStyle = this.color("delivered");
        pen.fillRect(x, top + SPLIT * row, width, (1 - SPLIT) * row - 1);
        continue;
      }
      pen.fillStyle = this.hatch();
      pen.fillRect(x, top + 1, width, row - 2);
      this.font(Math.min(13, 0.6 * row), 600);
      const text = this.record.causes[cause[i]], long = pen.measureText(text).width + 8;
      const room = (i + 1 < last ? this.x(start[i + 1]) : this.left + this.width) - x - 2;
      if (long > room || row < 12) continue;
      pen.fillStyle = this.color("paper");
      pen.fillRect(x + 2, top + 0.2 * row, long, 0.6 * row);
      pen.fillStyle = this.color("lost-ink");
      pen.fillText(text, x + 6, top + row / 2);
    }
  }

  // Return a pattern of red with dark stripes, visible as loss without seeing red.
  hatch() {
    const key = this.color("lost");
    if (this.hatched?.key === key) return this.hatched.pattern;
    const tile = new OffscreenCanvas(6, 6), pen = tile.getContext("2d");
    pen.fillStyle = key;
    pen.fillRect(0, 0, 6, 6);
    pen.strokeStyle = "#000a";
    pen.lineWidth = 1.4;
    for (const shift of [-6, 0, 6]) {
      pen.moveTo(shift, 6);
      pen.lineTo(shift + 6, 0);
    }
    pen.stroke();
    this.hatched = {key, pattern: this.pen.createPattern(tile, "repeat")};
    return this.hatched.pattern;
  }

  paintCurves(top) {
    const {pen} = this, height = this.curves - 14, base = top + height;
    const most = Math.max(...this.record.moments.map(moment => moment.sent_bytes), 1);
    const scale = byteScale(most), ceiling = niceCeiling(most / scale.bytes) * scale.bytes;
    this.font(12);
    for (const share of [0, 0.5, 1]) {
      const y = base - share * height;
      pen.strokeStyle = this.color("line");
      pen.lineWidth = 1;
      pen.beginPath();
      pen.moveTo(this.left, y);
      pen.lineTo(this.left + this.width, y);
      pen.stroke();
      pen.fillStyle = this.color("soft");
      if (CURVES.some(curve => curve.share && curve.known(this.record))) {
        pen.textAlign = "right";
        pen.fillText(percent(share), this.left - 6, y);
      }
      pen.textAlign = "left";
      pen.fillText(`${+(share * ceiling / scale.bytes).toPrecision(3)} ${scale.unit}`, this.left + this.width + 6, y);
    }
    const lossless = this.record.lossless_f_score;
    this.inside(() => {
      if (lossless !== null) this.paintLossless(base - lossless * height);
      for (const curve of CURVES) {
        const points = this.record.moments.filter(moment => curve.of(moment) !== null)
          .map(moment => [this.x(moment.t_s), base - curve.of(moment) / (curve.share ? 1 : ceiling) * height]);
        this.line(curve.color, curve.dash, 3, points);
        pen.fillStyle = this.color(curve.color);
        for (const [x, y] of points) pen.fillRect(x - 2.5, y - 2.5, 5, 5);
      }
    });
  }

  // Draw the F-score that a lossless delivery would have.
  paintLossless(y) {
    this.line("target", [2, 3], 1.5, [[this.left, y], [this.left + this.width, y]]);
    if (this.width < 500) return;
    this.pen.fillStyle = this.color("target");
    this.pen.fillText("F-score without loss", this.left + 4, y + 10);
  }

  line(color, dash, width, points) {
    const {pen} = this;
    pen.strokeStyle = this.color(color);
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.beginPath();
    points.forEach(([x, y], i) => i ? pen.lineTo(x, y) : pen.moveTo(x, y));
    pen.stroke();
    pen.setLineDash([]);
  }

  paintAxis(top) {
    const {pen} = this, step = tickStep((this.span * 70) / this.width), digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    this.font(12);
    pen.textAlign = "center";
    for (let n = Math.ceil(this.from / step); n * step <= (this.from + this.span) * 1.000001; n++) {
      const x = this.x(n * step);
      pen.fillStyle = this.color("line");
      pen.fillRect(x, 0, 1, top + 4);
      pen.fillStyle = this.color("ink");
      if (x < this.left + this.width - 12) pen.fillText(`${(n * step).toFixed(Math.min(digits, 6))} s`, x, top + 15);
    }
    if (this.record.frames_until_s < this.record.end_s && this.x(this.record.frames_until_s) < this.left + this.width) {
      pen.textAlign = "left";
      pen.fillText("later frames are not kept", Math.max(this.x(this.record.frames_until_s), this.left) + 4, this.rows - 8);
    }
  }

  // Draw the time after the clock pale.
  paintNow(base) {
    const {pen} = this, x = clamp(this.x(this.now), this.left, this.left + this.width);
    pen.globalAlpha = 0.55;
    pen.fillStyle = this.color("paper");
    pen.fillRect(x, 0, this.left + this.width - x, base);
    pen.globalAlpha = 1;
    if (this.now < this.from || this.now > this.from + this.span) return;
    pen.fillStyle = this.color("ink");
    pen.fillRect(x - 1, 0, 2, base);
    pen.beginPath();
    pen.moveTo(x, base - 7);
    pen.lineTo(x - 7, base + 4);
    pen.lineTo(x + 7, base + 4);
    pen.fill();
  }

  // Return the text for the item under the pointer.
  text(event) {
    const box = this.canvas.getBoundingClientRect(), node = Math.floor((event.clientY - box.top) / this.row);
    const t = this.time(event.clientX), name = this.record.nodes[node]?.name;
    if (event.clientX - box.left < this.left || !name) return "";
    if (this.near()) {
      const i = this.first(node, t) - 1, {start, end, cause, first} = this.frames;
      if (i < first[node] || end[i] < t) return `${name}, ${clock(t, this.span)}: not sending`;
      const took = `${((end[i] - start[i]) * 1e3).toPrecision(3)} ms on the air`;
      return `${name}, ${clock(start[i], this.span)}: ${took}, ${cause[i] ? `lost: ${this.record.causes[cause[i]]}` : "delivered"}`;
    }
    const half = 4 / this.width * this.span, {i, j, count, lost} = this.between(node, t - half, t + half);
    const why = new Map();
    for (let each = i; each < j; each++) {
      const cause = this.record.causes[this.frames.cause[each]];
      if (this.frames.cause[each]) why.set(cause, (why.get(cause) ?? 0) + 1);
    }
    const causes = [...why].map(([cause, number]) => `${cause} ${number}`).join(", ");
    return `${name} around ${clock(t, this.span)}: ${counted(count)}, ${lost ? `${whole(lost)} lost (${causes})` : "none lost"}`;
  }
}

// The curves, with the names and colours of the numbers above.
const CURVES = [
  {name: "F-score at 5 cm", color: "target", dash: [], share: true, of: moment => moment.f_score},
  {name: "Rays without a surface", color: "lost", dash: [9, 5], share: true, of: moment => moment.no_hit_share},
  {name: "Bytes delivered", color: "delivered", dash: [2, 4], share: false, of: moment => moment.delivered_bytes},
];
for (const curve of CURVES) curve.known = record => record.moments.some(moment => curve.of(moment) !== null);

// Numbers as text, with their units.

const whole = number => Math.round(number).toLocaleString("en");
const counted = number => `${whole(number)} frame${number === 1 ? "" : "s"}`;
const percent = share => `${+(100 * share).toPrecision(share < 0.1 ? 2 : 3)} %`;
const BYTE_UNITS = [{bytes: 1e9, unit: "GB"}, {bytes: 1e6, unit: "MB"}, {bytes: 1e3, unit: "kB"}, {bytes: 1, unit: "B"}];
const byteScale = bytes => BYTE_UNITS.find(each => bytes >= each.bytes) ?? BYTE_UNITS[3];
// Return bytes with as many digits as the largest value, so that a growing number keeps its width.
const bytesText = (bytes, most) => {
  const {bytes: one, unit} = byteScale(most);
  return `${(bytes / one).toFixed(one === 1 ? 0 : clamp(2 - Math.floor(Math.log10(most / one)), 0, 2))} ${unit}`;
};
const tickStep = least => {
  const ten = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map(each => each * ten).find(each => each >= least * 0.999);
};
const niceCeiling = value => {
  const ten = 10 ** Math.floor(Math.log10(value));
  return [1, 1.5, 2, 3, 4, 5, 6, 8, 10].map(each => each * ten).find(each => each >= value * 0.999);
};
// Return a time with as many digits as a window of this length needs.
const clock = (t, span) => `${t.toFixed(clamp(Math.ceil(2 - Math.log10(span)), 0, 6))} s`;
