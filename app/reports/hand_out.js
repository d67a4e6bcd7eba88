// Plays a delivery: unpacks the page's data and moves one clock, the picture, the numbers and the dock.

const PLAY_S = 20; // approximate duration of a delivery at the initial speed
const SPEEDS = [-3, -2, -1, 0, 1, 2, 3, 4].flatMap(ten => [1, 2, 5].map(each => each * 10 ** ten));

// Unpacking; the formats are those of packed_mesh.py and delivery.py.

// Return the unsigned numbers of a column that is stored byte plane by byte plane.
function column(bytes, offset, count, planes) {
  const numbers = new Uint32Array(count);
  for (let plane = 0; plane < planes; plane++)
    for (let i = 0, at = offset + plane * count; i < count; i++) numbers[i] |= bytes[at + i] << (8 * plane);
  return numbers;
}

async function meshOf(moment) {
  const bytes = await inflate(`mesh-${moment}`);
  const [vertices, faces] = new Uint32Array(bytes.slice(0, 8).buffer);
  const positions = new Uint16Array(4 * vertices), colors = new Uint8Array(4 * vertices).fill(255);
  let offset = 8;
  for (let axis = 0; axis < 3; axis++, offset += 2 * vertices) {
    let place = 0;
    column(bytes, offset, vertices, 2).forEach((zigzag, i) => {
      positions[4 * i + axis] = place += (zigzag >>> 1) ^ -(zigzag & 1);
    });
  }
  const channels = [1, 0, 2]; // green first, the others as differences to green
  for (const channel of channels) {
    let value = 0;
    for (let i = 0; i < vertices; i++) {
      value += bytes[offset + i];
      colors[4 * i + channel] = value + (channel === 1 ? 0 : colors[4 * i + 1]);
    }
    offset += vertices;
  }
  const triangles = new Uint32Array(3 * faces);
  for (let corner = 0, low = 0; corner < 3; corner++, offset += 4 * faces)
    column(bytes, offset, faces, 4).forEach((number, i) => {
      triangles[3 * i + corner] = corner ? triangles[3 * i] + number : low += number;
    });
  return {positions, colors, triangles};
}

// Return starts and ends in seconds, with running sums of the air time and of the losses.
async function framesOf(record) {
  const bytes = await inflate("frames"), nodes = record.nodes.length;
  const counts = new Uint32Array(bytes.slice(0, 4 * nodes).buffer);
  const first = [0];
  counts.forEach(count => first.push(first.at(-1) + count));
  const total = first.at(-1);
  const since = column(bytes, 4 * nodes, total, 4), duration = column(bytes, 4 * nodes + 4 * total, total, 4);
  const cause = bytes.subarray(4 * nodes + 8 * total);
  const start = new Float64Array(total), end = new Float64Array(total);
  const air = new Float64Array(total + 1), lost = new Uint32Array(total + 1);
  for (let node = 0; node < nodes; node++)
    for (let i = first[node], ticks = 0; i < first[node + 1]; i++) {
      ticks += since[i];
      start[i] = ticks * record.tick_s;
      end[i] = (ticks + duration[i]) * record.tick_s;
      air[i + 1] = air[i] + end[i] - start[i];
      lost[i + 1] = lost[i] + (cause[i] > 0);
    }
  return {first, start, end, cause, air, lost};
}

// The numbers: a name, the present value, and the value to compare it with.

const TILES = [
  {name: "Network time", now: (record, moment, t) => clock(t, record.end_s), of: record => `of ${clock(record.end_s, record.end_s)}`},
  {name: "Bytes delivered", color: "curve delivered", now: (record, moment) => bytesText(moment?.delivered_bytes ?? 0, allBytes(record)),
    of: (record, moment) => `of ${bytesText(moment?.sent_bytes ?? 0, allBytes(record))} sent`},
  {name: "Frames lost", color: "lost", now: (record, moment) => whole(moment?.packets_lost ?? 0), of: () => "so far"},
  {name: "Energy", now: (record, moment) => `${energy(moment?.energy_j ?? 0)} J`, of: () => "of all nodes"},
  {name: "F-score at 5 cm", color: "curve target", known: CURVES[0].known, now: (record, moment) => shareText(moment?.f_score),
    of: record => record.lossless_f_score === null ? "against the truth" : `of ${shareText(record.lossless_f_score)} without loss`},
  {name: "Rays without a surface", color: "curve lost", known: CURVES[1].known, now: (record, moment) => shareText(moment?.no_hit_share),
    of: () => "of the cameras' rays"},
];
const allBytes = record => Math.max(...record.moments.map(moment => moment.sent_bytes), 1);
const shareText = share => share === null || share === undefined ? "–" : `${(100 * share).toFixed(1)} %`;
const energy = joules => joules >= 1000 ? whole(joules) : joules.toFixed(joules < 10 ? 2 : 1);

class Player {
  constructor(record, frames) {
    this.record = record;
    this.t = 0;
    this.playing = false;
    this.stage = new Stage(find("stage"), record);
    this.dock = new Dock(find("timeline"), record, frames, t => this.seek(t));
    this.dock.hover = text => { find("readout").textContent = text; };
    this.dock.scaleText = text => { find("scale").textContent = text; };
    this.tiles = TILES.filter(tile => tile.known?.(record) ?? true).map(tile => this.addTile(tile));
    this.unpacked = new Map();
    this.addLegend();
    this.addControls();
    if (!this.stage.gl) find("about").textContent = "This browser has no WebGL2: the numbers and the timeline work, the picture does not.";
    this.seek(this.record.end_s);
  }

  addTile(tile) {
    const box = find("numbers").appendChild(document.createElement("div"));
    const [name, now, of] = ["dt", "dd", "dd"].map(kind => box.appendChild(document.createElement(kind)));
    if (tile.color) name.appendChild(document.createElement("i")).className = tile.color;
    name.append(tile.name);
    of.className = "of";
    return {...tile, box, texts: [now, of]};
  }

  addLegend() {
    for (const curve of CURVES.filter(each => each.known(this.record))) {
      const item = find("legend").insertBefore(document.createElement("li"), find("scale"));
      item.appendChild(document.createElement("i")).className = `curve ${curve.color}`;
      item.append(curve.share ? curve.name : `${curve.name} (right)`);
    }
  }

  addControls() {
    const speed = find("speed"), wanted = this.record.end_s / PLAY_S;
    const offered = SPEEDS.filter(each => each >= wanted / 60 && each <= wanted * 30);
    for (const each of offered) speed.add(new Option(`${+each.toPrecision(1)}×`, each));
    speed.value = offered.reduce((best, each) =>
      Math.abs(Math.log(each / wanted)) < Math.abs(Math.log(best / wanted)) ? each : best);
    const actions = {
      start: () => this.seek(0),
      back: () => this.step(-1),
      play: () => this.playing ? this.pause() : this.play(),
      step: () => this.step(1),
      end: () => this.seek(this.record.end_s),
      whole: () => this.dock.whole(),
      light: () => {
        toggleLight();
        this.redraw();
      },
    };
    for (const [id, action] of Object.entries(actions)) find(id).addEventListener("click", action);
    const keys = {Home: "start", ArrowLeft: "back", " ": "play", ArrowRight: "step", End: "end"};
    addEventListener("keydown", event => {
      const action = actions[keys[event.key]];
      if (!action || event.ctrlKey || event.metaKey || event.altKey || event.target.matches("select")) return;
      event.preventDefault(); // else the focused button would be clicked too
      action();
    });
    addEventListener("keyup", event => event.key === " " && event.preventDefault());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  redraw() {
    this.stage.draw();
    this.dock.draw();
  }

  // The clock.

  play() {
    if (this.t >= this.record.end_s) this.seek(0);
    this.playing = true;
    find("play").textContent = "Pause";
    let last = performance.now();
    const tick = now => {
      if (!this.playing) return;
      this.setTime(this.t + Math.max(now - last, 0) / 1000 * find("speed").value);
      last = now;
      if (this.t >= this.record.end_s) return this.pause();
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    find("play").textContent = "Play";
  }

  seek(t) {
    this.pause();
    this.setTime(t);
  }

  // Go to the next moment or the one before.
  step(way) {
    const times = [0, ...this.record.moments.map(moment => moment.t_s), this.record.end_s];
    const next = way > 0 ? times.find(t => t > this.t) : times.findLast(t => t < this.t);
    this.seek(next ?? this.t);
  }

  setTime(t) {
    this.t = clamp(t, 0, this.record.end_s);
    this.dock.setNow(this.t, true);
    const row = this.record.moments.findLastIndex(moment => moment.t_s <= this.t);
    const moment = this.record.moments[row];
    for (const tile of this.tiles)
      [tile.now, tile.of].forEach((text, i) => { tile.texts[i].textContent = text(this.record, moment, this.t); });
    if (row !== this.wanted) this.showMoment(row);
  }

  // Show the moment requested last, as soon as it is unpacked.
  async showMoment(row) {
    this.wanted = row;
    const {mesh, pictures} = await this.unpack(row);
    if (row !== this.wanted) return;
    this.stage.show(row, mesh, pictures);
    const moment = this.record.moments[row], shown = mesh.triangles.length / 3;
    const thinned = moment && shown < moment.triangles ? ` of ${whole(moment.triangles)}` : "";
    if (this.stage.gl) find("about").textContent = !shown ? "Nothing to build a surface from yet"
      : `The mesh at ${clock(moment.t_s, this.record.end_s)}: ${whole(shown)}${thinned} triangles`;
    document.documentElement.dataset.moment = row;
    if (row + 1 < this.record.moments.length) this.unpack(row + 1);
  }

  unpack(row) {
    if (!this.unpacked.has(row)) this.unpacked.set(row, this.unpackNow(row));
    return this.unpacked.get(row);
  }

  async unpackNow(row) {
    const none = {positions: new Uint16Array(), colors: new Uint8Array(), triangles: new Uint32Array()};
    const bitmap = async node => {
      const bytes = bytesOf(`picture-${row}-${node}`);
      return bytes && createImageBitmap(new Blob([bytes], {type: "image/jpeg"}));
    };
    const [mesh, pictures] = await Promise.all([
      row < 0 ? none : meshOf(row),
      Promise.all(this.record.nodes.map((_, node) => row < 0 ? null : bitmap(node))),
    ]);
    return {mesh, pictures};
  }
}

{
  const record = JSON.parse(find("record").textContent);
  framesOf(record).then(frames => new Player(record, frames));
}
