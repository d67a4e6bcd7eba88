// Plays a race: every lane shows its cloud's registration from the same viewpoint, with its error.

const CLOUD_VERTEX = `#version 300 es
uniform mat4 view, pose;
uniform vec3 stops[5];
uniform vec4 own;
uniform float size;
in vec3 place;
in float shade;
out vec3 seen;
void main() {
  float at = min(shade * 4.0, 3.9999);
  seen = own.a > 0.0 ? own.rgb : mix(stops[int(at)], stops[int(at) + 1], fract(at));
  gl_Position = view * pose * vec4(place, 1.0);
  gl_PointSize = max(size / gl_Position.w, 1.5);
}`;
const CLOUD_FRAGMENT = `#version 300 es
precision highp float;
in vec3 seen;
out vec4 color;
void main() { color = vec4(seen, 1.0); }`;
const POINT_M = 0.012, PLAY_S = 10, MOST_STEP_S = 0.5, DOT_CM = 0.35, RULER_CM = 10;
const CURVE_PX = [66, 18]; // space left and right of the curves
const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const rgbOf = css => [1, 3, 5].map(at => parseInt(css.slice(at, at + 2), 16) / 255);

class Clouds extends View {
  constructor(canvas, record, rooms, {source, target, shades}) {
    super(canvas, record.view);
    Object.assign(this, {record, rooms, shades, count: source.length / 3, rows: record.runs.map(() => 0)});
    if (!this.gl) return;
    const gl = this.gl;
    this.clouds = [target, source].map(places => {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      this.attribute(0, places, gl.FLOAT, false, 3);
      return {array, count: places.length / 3};
    });
    this.shaded = this.attribute(1, shades[0].subarray(0, this.count), gl.UNSIGNED_BYTE, true, 1);
    gl.bindVertexArray(null);
    const set = (name, value, kind) => gl[`uniform${kind}fv`](gl.getUniformLocation(this.points, name), value);
    this.set = set;
    gl.useProgram(this.points);
    set("stops", record.scale.stops.flatMap(rgbOf), 3);
  }

  prepare() { this.points = this.program(CLOUD_VERTEX, CLOUD_FRAGMENT, ["place", "shade"]); }

  paint() {
    if (!this.clouds || !this.begin()) return;
    const gl = this.gl, box = this.canvas.getBoundingClientRect(), ratio = this.canvas.width / box.width;
    this.record.runs.forEach((run, lane) => {
      const room = this.rooms[lane].getBoundingClientRect(), row = this.rows[lane];
      const [width, height] = [room.width * ratio, room.height * ratio];
      gl.viewport((room.left - box.left) * ratio, (box.bottom - room.bottom) * ratio, width, height);
      const {matrix} = this.camera(width, height);
      gl.uniformMatrix4fv(gl.getUniformLocation(this.points, "view"), false, matrix);
      gl.uniform1f(gl.getUniformLocation(this.points, "size"), POINT_M * Math.min(height, 0.75 * width) / HALF_ANGLE / 2);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.shaded);
      gl.bufferData(gl.ARRAY_BUFFER, this.shades[lane].subarray(row * this.count, (row + 1) * this.count), gl.DYNAMIC_DRAW);
      [IDENTITY, run.poses[row]].forEach((pose, which) => {
        gl.uniformMatrix4fv(gl.getUniformLocation(this.points, "pose"), false, pose);
        this.set("own", which ? [0, 0, 0, 0] : [...rgbOf(this.record.scale.stays), 1], 4);
        gl.bindVertexArray(this.clouds[which].array);
        gl.drawArrays(gl.POINTS, 0, this.clouds[which].count);
      });
      gl.bindVertexArray(null);
    });
  }
}

const make = (tag, into, text = "") => {
  const made = into.appendChild(document.createElement(tag));
  made.textContent = text;
  return made;
};

class Race {
  constructor(record, blocks) {
    this.record = record;
    this.blocks = blocks;
    this.lanes = record.runs.map(run => this.addLane(run));
    this.layOut();
    this.clouds = new Clouds(find("stage").querySelector("canvas"), record, this.lanes.map(lane => lane.room), blocks);
    this.addScale();
    this.addControls();
    addEventListener("resize", () => this.layOut());
    new ResizeObserver(() => this.show(this.now)).observe(find("curve"));
    this.show(0);
    document.documentElement.dataset.ready = true;
  }

  layOut() {
    const {length} = this.lanes, narrow = innerWidth < 700;
    find("lanes").style.setProperty("--columns", narrow && length > 2 ? 2 : length);
  }

  addLane(run) {
    const lane = make("div", find("lanes")), head = make("div", lane);
    lane.className = "lane";
    head.className = "head";
    lane.style.setProperty("--color", run.color);
    make("span", head, run.name);
    const number = make("b", head), note = make("i", head), room = make("div", lane);
    room.className = "room";
    const lens = this.record.lens_cm === null ? null : make("canvas", lane);
    if (lens) lens.className = "lens";
    const from = run.lens.reduce((ends, count) => [...ends, ends.at(-1) + 3 * count], [0]);
    return {lane, number, note, room, lens, from, run};
  }

  addScale() {
    const {words, stops, stays} = this.record.scale, box = find("scale");
    make("span", box, words[0]);
    make("span", box, words[1]);
    make("i", box).style.background = `linear-gradient(to right, ${stops.join(", ")})`;
    make("span", box, words[2]);
    make("b", box).style.background = stays;
    make("span", box, "the cloud that stays");
  }

  addControls() {
    const last = this.record.steps - 1, go = to => () => { this.pause(); this.show(to()); };
    find("scrub").max = last;
    find("scrub").addEventListener("input", go(() => Number(find("scrub").value)));
    const actions = {
      start: go(() => 0), back: go(() => this.now - 1), step: go(() => this.now + 1), end: go(() => last),
      play: () => this.playing ? this.pause() : this.play(),
      light: () => { toggleLight(); this.show(this.now); },
    };
    for (const [id, action] of Object.entries(actions)) find(id).addEventListener("click", action);
    const keys = {Home: "start", ArrowLeft: "back", " ": "play", ArrowRight: "step", End: "end"};
    addEventListener("keydown", event => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      actions[keys[event.key]]();
    });
    addEventListener("keyup", event => event.key === " " && event.preventDefault());
    find("curve").addEventListener("click", event => {
      const box = find("curve").getBoundingClientRect();
      go(() => Math.round((event.clientX - box.left - CURVE_PX[0]) / (box.width - CURVE_PX[0] - CURVE_PX[1]) * last))();
    });
  }

  play() {
    const last = this.record.steps - 1, each = Math.min(PLAY_S / Math.max(last, 1), MOST_STEP_S);
    const from = this.now >= last ? 0 : this.now, began = performance.now();
    this.playing = true;
    find("play").textContent = "Pause";
    const tick = now => {
      if (!this.playing) return;
      const step = Math.min(from + Math.floor(Math.max(now - began, 0) / 1000 / each), last);
      if (step !== this.now) this.show(step);
      if (step >= last) return this.pause();
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    find("play").textContent = "Play";
  }

  show(step) {
    this.now = clamp(step, 0, this.record.steps - 1);
    find("scrub").value = find("now").textContent = this.now;
    this.lanes.forEach((lane, index) => {
      const {run} = lane, row = this.clouds.rows[index] = Math.min(this.now, run.poses.length - 1);
      lane.number.textContent = run.offs[row];
      lane.note.textContent = run.notes[row];
      const ended = row === run.poses.length - 1 && run.arrived !== null;
      lane.lane.dataset.state = !ended ? "running" : run.arrived ? "arrived" : "missed";
      if (lane.lens) this.drawLens(lane, index, row);
    });
    this.clouds.draw();
    this.drawCurve();
  }

  pen(canvas) {
    const ratio = devicePixelRatio || 1, {clientWidth: width, clientHeight: height} = canvas;
    Object.assign(canvas, {width: Math.round(width * ratio), height: Math.round(height * ratio)});
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    pen.font = "13px system-ui, sans-serif";
    return {pen, width, height};
  }

  // Draw the corner, cut across: the target in grey, the source in the scale's colours.
  drawLens(lane, index, row) {
    const {pen, width, height} = this.pen(lane.lens), {lens_cm, scale} = this.record;
    const cm = Math.max(width, height) / lens_cm, size = Math.max(DOT_CM * cm, 2);
    const stops = scale.stops.map(rgbOf);
    const dot = (column, line, color) => {
      pen.fillStyle = color;
      pen.fillRect(width / 2 + (column / 255 - 0.5) * lens_cm * cm - size / 2, height / 2 + (line / 255 - 0.5) * lens_cm * cm - size / 2, size, size);
    };
    const still = this.blocks.lens, moved = this.blocks.corners[index].subarray(lane.from[row], lane.from[row + 1]);
    for (let at = 0; at < still.length; at += 2) dot(still[at], still[at + 1], scale.stays);
    for (let at = 0; at < moved.length; at += 3) {
      const place = Math.min(moved[at + 2] / 255 * 4, 3.9999), low = Math.floor(place);
      const mixed = stops[low].map((one, i) => 255 * (one + (place - low) * (stops[low + 1][i] - one)));
      dot(moved[at], moved[at + 1], `rgb(${mixed.map(Math.round).join(",")})`);
    }
    pen.fillStyle = "#111";
    pen.fillText(moved.length ? "a corner magnified" : "the moving cloud is out of sight", 8, 16, width - 16);
    const long = RULER_CM * cm;
    pen.fillRect(8, height - 10, long, 3);
    pen.font = "700 14px system-ui, sans-serif";
    pen.fillText(`${RULER_CM} cm`, 8, height - 16);
  }

  drawCurve() {
    const {pen, width, height} = this.pen(find("curve")), last = Math.max(this.record.steps - 1, 1);
    const ink = getComputedStyle(find("curve")).color, most = Math.max(1, ...this.record.runs.flatMap(run => run.offs_cm.map(off => off ?? 0)));
    const [left, right, top, base] = [CURVE_PX[0], width - CURVE_PX[1], 8, height - 18];
    const x = step => left + step / last * (right - left), y = off => base - off / most * (base - top);
    pen.fillStyle = pen.strokeStyle = ink;
    pen.globalAlpha = 0.25;
    for (const off of [0, most / 2, most]) pen.fillRect(left, y(off), right - left, 1);
    pen.globalAlpha = 1;
    pen.textAlign = "right";
    for (const off of [0, most]) pen.fillText(`${off.toFixed(off ? 1 : 0)} cm`, left - 6, y(off) + 4);
    pen.textAlign = "center";
    for (const step of [0, last]) pen.fillText(step, x(step), height - 4);
    pen.lineWidth = 3;
    for (const run of this.record.runs) {
      pen.strokeStyle = run.color;
      pen.beginPath();
      let known = false; // whether the step before has a number; the curve has a gap where there is none
      for (let step = 0; step <= this.now; step++) {
        const off = run.offs_cm[Math.min(step, run.offs_cm.length - 1)];
        if (off !== null) pen[known ? "lineTo" : "moveTo"](x(step), y(off));
        known = off !== null;
      }
      pen.stroke();
    }
    pen.fillRect(x(this.now) - 1, top, 2, base - top);
  }
}

{
  const record = JSON.parse(find("record").textContent);
  const some = async id => find(id) ? inflate(id) : new Uint8Array();
  const each = name => Promise.all(record.runs.map((_, row) => inflate(`${name}-${row}`)));
  Promise.all([inflate("source"), inflate("target"), some("lens"), each("shades"), each("lens")])
    .then(([source, target, lens, shades, corners]) => new Race(record, {
      source: new Float32Array(source.buffer), target: new Float32Array(target.buffer), lens, shades, corners,
    }));
}
