// Unpacks what packing.py packs; its text describes the parts.
window.packetmeshUnpack = (() => {
  const SHADES = Uint16Array.from({length: 256}, (_, shade) => {
    const srgb = shade / 255;
    return Math.round(65535 * (srgb <= 0.04045 ? srgb / 12.92 : ((srgb + 0.055) / 1.055) ** 2.4));
  });
  const OPAQUE = 65535;

  // Undo planes and zig-zag: return a function that gives the next column's `rows` differences.
  function columnsOf(bytes, rows, size) {
    let at = 0;
    return () => {
      const column = new Int32Array(rows);
      for (let plane = 0; plane < size; plane++, at += rows)
        for (let row = 0; row < rows; row++) column[row] |= bytes[at + row] << 8 * plane;
      for (let row = 0; row < rows; row++) column[row] = (column[row] >>> 1) ^ -(column[row] & 1);
      return column;
    };
  }

  function summed(column) {
    for (let row = 1; row < column.length; row++) column[row] += column[row - 1];
    return column;
  }

  // (rows, 3) RGB of three planes of differences.
  function rgbOf(bytes, rows) {
    const rgb = new Uint8Array(3 * rows);
    let [green, red, blue] = [0, 0, 0];
    for (let row = 0; row < rows; row++) {
      green += bytes[row];
      red += bytes[rows + row];
      blue += bytes[2 * rows + row];
      rgb.set([red + green, green, blue + green], 3 * row);
    }
    return rgb;
  }

  function put(view, at, size, value) {
    if (size === 1) view.setUint8(at, value);
    else if (size === 2) view.setUint16(at, value, true);
    else view.setUint32(at, value, true);
  }

  // Return two places for each vertex K. They hold the corners below K of the first triangle that has corner K, and K
  // itself where there are fewer.
  function cornersBelow(triangles, vertices) {
    const below = new Uint32Array(2 * vertices), met = new Uint8Array(vertices);
    for (let vertex = 0; vertex < vertices; vertex++) below[2 * vertex] = below[2 * vertex + 1] = vertex;
    for (let at = 0; at < triangles.length; at++) {
      const vertex = triangles[at], first = at - at % 3;
      if (vertex >= vertices || met[vertex]) continue;
      met[vertex] = 1;
      for (let corner = first, place = 2 * vertex; corner < first + 3; corner++)
        if (triangles[corner] < vertex) below[place++] = triangles[corner];
    }
    return below;
  }

  // For each kind of part: its packed bytes, its unpacked bytes, and how to unpack it at a place of a DataView.
  // The corners of triangles are given to the vertices, which are unpacked last.
  const KINDS = {
    raw: count => ({
      packed: count,
      unpacked: count,
      write: (bytes, view, at) => new Uint8Array(view.buffer, at, count).set(bytes),
    }),
    rows: (rows, columns, size, stride) => ({
      packed: rows * columns * size,
      unpacked: rows * stride,
      write(bytes, view, at) {
        const next = columnsOf(bytes, rows, size);
        for (let column = 0; column < columns; column++)
          summed(next()).forEach((value, row) => put(view, at + row * stride + column * size, size, value));
      },
    }),
    vertices: (rows, columns, size, stride, unit) => ({
      packed: rows * columns * size,
      unpacked: rows * stride,
      write(bytes, view, at, triangles) {
        const next = columnsOf(bytes, rows, size), below = cornersBelow(triangles, rows), wrap = 2 ** (8 * size);
        for (let column = 0; column < columns; column++) {
          const steps = next(), values = new Float64Array(rows);
          for (let row = 0; row < rows; row++) {
            const one = below[2 * row], other = below[2 * row + 1];
            const expected = other < row ? Math.floor((values[one] + values[other]) / 2)
              : one < row ? values[one] : row > 0 ? values[row - 1] : 0;
            values[row] = (expected + steps[row] + wrap) % wrap;
            put(view, at + row * stride + column * size, size, unit * values[row]);
          }
        }
      },
    }),
    grid: (rows, columns, bits) => ({
      packed: 4 * rows * columns,
      unpacked: 4 * rows * columns,
      write(bytes, view, at) {
        const next = columnsOf(bytes, rows, 4);
        for (let column = 0; column < columns; column++)
          summed(next()).forEach((value, row) => view.setFloat32(at + 4 * (row * columns + column), value / 2 ** bits, true));
      },
    }),
    triangles: (rows, size) => ({
      packed: 3 * rows * size,
      unpacked: 3 * rows * size,
      write(bytes, view, at) {
        const next = columnsOf(bytes, rows, size), columns = [next(), next(), next()], wrap = 2 ** (8 * size);
        const within = value => ((value % wrap) + wrap) % wrap, corners = new Uint32Array(3 * rows);
        let [a, b, c, greatest, last] = [0, 0, 0, -1, -1];
        for (let row = 0; row < rows; row++) {
          a = within(a + columns[0][row]);
          const following = Math.max(greatest, a) + 1;
          b = within((a === last ? c : following) - columns[1][row]);
          c = within(Math.max(following, b + 1) - columns[2][row]);
          greatest = Math.max(following - 1, b, c);
          last = a;
          corners[3 * row] = a;
          corners[3 * row + 1] = b;
          corners[3 * row + 2] = c;
        }
        corners.forEach((corner, row) => put(view, at + row * size, size, corner));
        return corners;
      },
    }),
    colors: rows => ({
      packed: 3 * rows,
      unpacked: 3 * rows,
      write: (bytes, view, at) => new Uint8Array(view.buffer, at, 3 * rows).set(rgbOf(bytes, rows)),
    }),
    light: rows => ({
      packed: 3 * rows,
      unpacked: 8 * rows,
      write(bytes, view, at) {
        const rgb = rgbOf(bytes, rows);
        for (let row = 0; row < rows; row++) {
          for (let column = 0; column < 3; column++)
            view.setUint16(at + 8 * row + 2 * column, SHADES[rgb[3 * row + column]], true);
          view.setUint16(at + 8 * row + 6, OPAQUE, true);
        }
      },
    }),
  };

  // Return the unpacked content of a Uint8Array as a Uint8Array of its own.
  return packed => {
    const length = new DataView(packed.buffer, packed.byteOffset).getUint32(0, true);
    const parts = JSON.parse(new TextDecoder().decode(packed.subarray(4, 4 + length)))
      .map(([kind, ...numbers]) => ({kind, ...KINDS[kind](...numbers)}));
    const view = new DataView(new ArrayBuffer(parts.reduce((sum, part) => sum + part.unpacked, 0)));
    let from = 4 + length, to = 0, triangles;
    const last = [];
    for (const {kind, packed: size, unpacked, write} of parts) {
      const bytes = packed.subarray(from, from + size), at = to;
      if (kind === "vertices") last.push(() => write(bytes, view, at, triangles));
      else if (kind === "triangles") triangles = write(bytes, view, at);
      else write(bytes, view, at);
      from += size;
      to += unpacked;
    }
    last.forEach(write => write());
    return new Uint8Array(view.buffer);
  };
})();
