// A scale bar and the directions of the world's axes over the picture, redrawn as the view turns.
(() => {
  const MOST_PX = 160; // longest bar
  const AXIS_PX = 30;
  const NAMES = ["x", "y", "z"];
  const ROUND = [1, 2, 5];
  const SVG = "http://www.w3.org/2000/svg";
  let place = null; // the element over the picture
  let text = "";

  function add(parent, name, attributes = {}) {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    parent.append(element);
    return element;
  }

  function make() {
    place = document.createElement("div");
    place.className = "packetmesh-scale";
    place.innerHTML = "<svg></svg><div><i></i><b></b><span></span></div>";
    const drawing = place.querySelector("svg");
    drawing.setAttribute("viewBox", "-44 -44 88 88");
    for (const name of NAMES) {
      const axis = add(drawing, "g", {class: name});
      add(axis, "line", {x1: 0, y1: 0});
      add(axis, "text").textContent = name;
    }
  }

  // Return the longest of 1, 2 and 5 times a power of ten that is at most so long.
  function roundBelow(most) {
    const power = 10 ** Math.floor(Math.log10(most) + 1e-9);
    return power * Math.max(...ROUND.filter(factor => factor * power <= most * (1 + 1e-9)));
  }

  function lengthText(metres) {
    const [unit, name] = metres >= 1 ? [1, "m"] : metres >= 0.01 ? [0.01, "cm"] : [0.001, "mm"];
    return `${Number((metres / unit).toPrecision(3))} ${name}`;
  }

  function draw(camera, root) {
    const picture = document.querySelector("canvas[data-engine]");
    const Vector = root.position.constructor;
    const target = window.__viserMutable.cameraControl.getTarget(new Vector());
    const away = -target.applyMatrix4(camera.matrixWorldInverse).z;
    const metresPerPx = 2 * away * Math.tan(camera.fov * Math.PI / 360) / picture.clientHeight;
    const length = roundBelow(MOST_PX * metresPerPx);
    const toView = camera.matrixWorldInverse.clone().multiply(root.matrixWorld);
    const axes = NAMES.map((_, row) => new Vector(...NAMES.map((_, other) => Number(row === other))).transformDirection(toView));
    const now = JSON.stringify([length, Math.round(length / metresPerPx), away.toFixed(2), axes.map(({x, y}) => [x.toFixed(2), y.toFixed(2)])]);
    if (!place.isConnected) picture.parentElement.parentElement.append(place);
    if (now === text) return;
    text = now;
    const far = NAMES.map((name, row) => [axes[row].z, `${name},${axes[row].x.toFixed(2)},${axes[row].y.toFixed(2)}`]);
    far.sort(([one], [other]) => one - other);
    const directions = far.map(([, axis]) => axis).join(";");
    place.dataset.bar = away <= 0 ? "" : `${(length / metresPerPx).toFixed(1)} ${lengthText(length)} ${away.toFixed(away < 1 ? 2 : 1)} ${directions}`;
    place.querySelector("i").style.width = `${length / metresPerPx}px`;
    place.querySelector("b").textContent = lengthText(length);
    place.querySelector("span").textContent = `${away.toFixed(away < 1 ? 2 : 1)} m away, where the view turns`;
    axes.forEach(({x, y}, row) => {
      const axis = place.querySelector(`g.${NAMES[row]}`);
      const [line, name] = axis.children;
      line.setAttribute("x2", AXIS_PX * x);
      line.setAttribute("y2", -AXIS_PX * y);
      name.setAttribute("x", (AXIS_PX + 8) * x);
      name.setAttribute("y", -(AXIS_PX + 8) * y);
      if (axes[row].z > 0) axis.parentElement.append(axis); // towards the viewer: over the others
    });
  }

  window.packetmeshFrames.before((renderer, scene, camera) => {
    const shown = window.packetmeshLook.shown();
    if (!shown?.look.ruler || !window.__viserMutable.cameraControl) return void place?.remove();
    if (!place) make();
    draw(camera, shown.root);
  });
})();
