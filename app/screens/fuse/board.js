// The board over a race: names, large numbers and the colour scale. The server's part is board.py.
(() => {
  const RULER_CM = 10;
  const DOT_CM = 0.35;
  const boards = new Map();
  const {DockRow, make} = window.packetmeshDockRow;

  const bytes = text => Uint8Array.from(atob(text), one => one.charCodeAt(0));

  // Return a colour for every shade, interpolated between equally spaced stops.
  function palette(stops) {
    const channels = stops.map(stop => [1, 3, 5].map(at => parseInt(stop.slice(at, at + 2), 16)));
    return Array.from({length: 256}, (_, shade) => {
      const at = shade / 255 * (stops.length - 1);
      const low = Math.min(Math.floor(at), stops.length - 2);
      const mixed = channels[low].map((one, index) => one + (at - low) * (channels[low + 1][index] - one));
      return `rgb(${mixed.map(Math.round).join(", ")})`;
    });
  }

  class Board extends DockRow {
    constructor(name) {
      super(name, "Race");
      this.row.className = "packetmesh-board";
      this.row.removeAttribute("tabindex");
      this.lanes = [];
      this.scores = [];
    }

    // The board is placed over the picture.
    home() {
      return document.querySelector("canvas[data-engine]")?.parentElement.parentElement;
    }

    setup({visible, lens, band, lanes, scale}) {
      this.wanted = visible;
      this.band = band;
      this.row.replaceChildren();
      this.row.style.setProperty("--lens", `${100 * (1 - band[2])}%`);
      this.lens = lens && {...lens, target: bytes(lens.target)};
      this.colors = palette(scale.stops);
      this.lanes = lanes.map(lane => this.addLane(lane));
      const legend = make("div", "scale", this.row);
      make("span", "", legend, {textContent: scale.text});
      make("span", "", legend, {textContent: scale.ends[0]});
      make("i", "", legend).style.background = `linear-gradient(to right, ${scale.stops.join(", ")})`;
      make("span", "", legend, {textContent: scale.ends[1]});
      for (const [sign, text] of [["b", scale.target], ["u", scale.pairs]])
        make("span", "", legend, {textContent: text}).prepend(make(sign, ""));
      this.state({lanes: this.scores});
      if (this.visible) this.came();
    }

    came() {
      window.packetmeshLanes.show(this.lanes.length, this.band);
    }

    left() {
      window.packetmeshLanes.show(0, this.band);
    }

    addLane({name, color, about, source}) {
      const lane = make("div", "lane", this.row);
      lane.style.setProperty("--color", color);
      const head = make("div", "head", lane);
      const title = make("div", "title", head);
      make("span", "", title, {textContent: name});
      const ask = make("button", "", title, {textContent: "?", type: "button", ariaLabel: `What ${name} does`});
      const number = make("div", "number", head);
      const value = make("b", "", number);
      const unit = make("span", "", number);
      const note = make("div", "note", head);
      const verdict = make("div", "verdict", head);
      const answer = make("div", "answer", head, {hidden: true});
      make("p", "", answer, {textContent: about});
      make("p", "source", answer, {textContent: source});
      ask.addEventListener("click", () => { answer.hidden = !answer.hidden; });
      const made = {head, value, unit, note, verdict, seen: new Uint8Array()};
      if (this.lens) {
        const lens = make("div", "lens", lane);
        const caption = make("div", "caption", lens);
        made.seeing = make("span", "", caption);
        made.ruler = make("b", "", caption, {textContent: `${RULER_CM} cm`});
        made.glass = make("canvas", "", lens);
      }
      const {glass} = made;
      if (glass) new ResizeObserver(() => this.drawLens(made)).observe(glass);
      return made;
    }

    // Draw the corner marked by the ring, cut across: the target in grey, the source in the scale's colours.
    drawLens({glass, ruler, seeing, seen}) {
      const sharp = window.devicePixelRatio;
      const [width, height] = [glass.clientWidth, glass.clientHeight];
      Object.assign(glass, {width: width * sharp, height: height * sharp});
      const pen = glass.getContext("2d");
      pen.scale(sharp, sharp);
      const cm = Math.max(width, height) / this.lens.window;
      const size = Math.max(DOT_CM * cm, 2);
      const dot = (column, row, color) => {
        pen.fillStyle = color;
        const [x, y] = [column, row].map(place => (place / 255 - 0.5) * this.lens.window * cm);
        pen.fillRect(width / 2 + x - size / 2, height / 2 + y - size / 2, size, size);
      };
      const {target} = this.lens;
      for (let at = 0; at < target.length; at += 2) dot(target[at], target[at + 1], "#78828c");
      for (let at = 0; at < seen.length; at += 3) dot(seen[at], seen[at + 1], this.colors[seen[at + 2]]);
      ruler.style.width = `${RULER_CM * cm}px`;
      seeing.textContent = seen.length ? "the ringed edge, cut across" : "the moving cloud is out of sight";
    }

    state({lanes}) {
      this.scores = lanes;
      this.lanes.forEach((lane, index) => {
        const said = lanes[index];
        if (!said) return;
        lane.value.textContent = said.number;
        lane.unit.textContent = said.unit;
        lane.note.textContent = said.note;
        lane.verdict.textContent = said.verdict;
        lane.head.dataset.state = said.state;
        lane.seen = bytes(said.lens);
        if (lane.glass) this.drawLens(lane);
      });
    }
  }

  packetmesh.calls.board = (_, message) => {
    if (!boards.has(message.dock)) boards.set(message.dock, new Board(message.dock));
    const board = boards.get(message.dock);
    board[message.kind](message);
    board.place();
  };
})();
