// Draws a twin.glb: its nodes, lit; a grid, joint axes, a target; says what lies under a pixel. It knows the glTF that
// `consac twin import` writes (one buffer, float positions and normals, 32-bit indices, no textures, no scale), no other.
import * as matrix from "/matrix.js";

const VERTEX = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
uniform mat4 camera, model;
out vec3 world, turned;
void main() {
  vec4 at = model * vec4(position, 1.0);
  world = at.xyz;
  turned = mat3(model) * normal;
  gl_Position = camera * at;
}`;

// Two lights and a sky; Schlick's Fresnel, the GGX distribution. Source: Karis 2013, Real Shading in Unreal Engine 4.
const LIT = `#version 300 es
precision highp float;
in vec3 world, turned;
uniform vec3 eye;
uniform vec4 colour;      // linear
uniform float roughness, glow;
out vec4 pixel;
vec3 light(vec3 n, vec3 v, vec3 l, vec3 strength) {
  vec3 h = normalize(v + l);
  float nl = max(dot(n, l), 0.0), nh = max(dot(n, h), 0.0), vh = max(dot(v, h), 0.0), a = roughness * roughness;
  float d = nh * nh * (a * a - 1.0) + 1.0;
  float shine = a * a / (3.1416 * d * d) * (0.04 + 0.96 * pow(1.0 - vh, 5.0)) * 0.25;
  return strength * nl * (colour.rgb + shine);
}
void main() {
  vec3 n = normalize(gl_FrontFacing ? turned : -turned), v = normalize(eye - world);
  vec3 sky = mix(vec3(0.28, 0.26, 0.24), vec3(0.55, 0.60, 0.68), 0.5 + 0.5 * n.y);
  vec3 sum = colour.rgb * sky + light(n, v, normalize(vec3(0.5, 1.0, 0.6)), vec3(0.95, 0.92, 0.88))
           + light(n, v, normalize(vec3(-0.8, 0.4, -0.5)), vec3(0.22, 0.25, 0.30));
  sum = mix(sum, vec3(1.0, 0.45, 0.1), glow);
  pixel = vec4(pow(1.0 - exp(-1.4 * sum), vec3(1.0 / 2.2)), colour.a);  // white in full light keeps its edges
}`;

const FLAT = `#version 300 es
precision highp float;
uniform vec4 colour;
out vec4 pixel;
void main() { pixel = colour; }`;

function compile(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error("WebGL: " + gl.getProgramInfoLog(program));
  const names = ["camera", "model", "eye", "colour", "roughness", "glow"];
  return { program, at: Object.fromEntries(names.map((name) => [name, gl.getUniformLocation(program, name)])) };
}

/** The JSON and the numbers of a GLB. */
export function takeApart(buffer) {
  const view = new DataView(buffer), length = view.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
  return { json, numbers: 28 + length <= buffer.byteLength ? buffer.slice(28 + length) : new ArrayBuffer(0) };
}

export class Scene {
  /** `linkOfNode`: the name of a link for the numbers of nodes that are one. */
  constructor(canvas, glb, linkOfNode) {
    const gl = this.gl = canvas.getContext("webgl2", { antialias: true });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.canvas = canvas;
    this.lit = compile(gl, VERTEX, LIT);
    this.flat = compile(gl, VERTEX, FLAT);
    const { json, numbers } = takeApart(glb);
    this.nodes = json.nodes;
    this.rest = json.nodes.map((node) => matrix.fromPose(node.translation ?? [0, 0, 0], node.rotation ?? [0, 0, 0, 1]));
    this.motion = new Map();  // of nodes that move
    this.readMeshes(json, numbers);
    this.links = [...new Set(linkOfNode.values())];
    this.parts = [];          // what is drawn: a mesh, its node, its link
    const visit = (node, link) => {
      const own = linkOfNode.get(node) ?? link;
      if (json.nodes[node].mesh !== undefined) this.parts.push({ node, link: own, mesh: this.meshes[json.nodes[node].mesh] });
      for (const child of json.nodes[node].children ?? []) visit(child, own);
    };
    visit(0, undefined);
    this.line = this.upload(new Float32Array([0, 0, 0, 1, 0, 0]), null, null);
    this.makeGrid();
    this.makeBall();
    this.makePicker();
    this.camera = { turn: 0.7, tilt: 0.35, distance: 2, at: [0, 0, 0] };
    this.show = { grid: true, axes: [], lines: [], still: true, targets: [], hovered: null, chosen: null };
    this.place();
    this.fit();
  }

  upload(positions, normals, indices) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    [positions, normals].forEach((numbers, place) => {
      if (!numbers) return;
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    });
    if (indices) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    }
    gl.bindVertexArray(null);
    return array;
  }

  readMeshes(json, numbers) {
    const read = (Kind, accessor, width) => {
      const { bufferView, byteOffset = 0, count } = json.accessors[accessor];
      return new Kind(numbers, (json.bufferViews[bufferView].byteOffset ?? 0) + byteOffset, count * width);
    };
    this.meshes = (json.meshes ?? []).map(({ primitives }) => primitives.map((primitive) => {
      const { POSITION, NORMAL } = primitive.attributes;
      const indices = read(Uint32Array, primitive.indices, 1), look = json.materials[primitive.material];
      const { baseColorFactor, roughnessFactor } = look.pbrMetallicRoughness;
      return {
        array: this.upload(read(Float32Array, POSITION, 3), read(Float32Array, NORMAL, 3), indices), count: indices.length,
        low: json.accessors[POSITION].min, high: json.accessors[POSITION].max, colour: baseColorFactor, roughness: roughnessFactor,
      };
    }));
  }

  makeGrid() {
    const lines = [];
    for (let i = -10; i <= 10; ++i) lines.push(i, 0, -10, i, 0, 10, -10, 0, i, 10, 0, i);
    this.grid = { array: this.upload(new Float32Array(lines), null, null), count: lines.length / 3 };
  }

  makeBall() {
    const points = [], indices = [], n = 24;
    for (let i = 0; i <= n; ++i) {
      for (let j = 0; j <= n; ++j) {
        const a = Math.PI * i / n, b = 2 * Math.PI * j / n;
        points.push(Math.sin(a) * Math.cos(b), Math.cos(a), Math.sin(a) * Math.sin(b));
        const at = i * (n + 1) + j;
        if (i < n && j < n) indices.push(at, at + 1, at + n + 1, at + 1, at + n + 2, at + n + 1);
      }
    }
    const numbers = new Float32Array(points);
    this.ball = { array: this.upload(numbers, numbers, new Uint32Array(indices)), count: indices.length };
  }

  makePicker() {
    const gl = this.gl;
    this.picker = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picker);
    this.pickColour = gl.createRenderbuffer();
    this.pickDepth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.pickColour);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, this.pickColour);
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.pickDepth);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.pickDepth);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** A joint's node turns about its X axis by `position` rad, or slides along it by so many m. */
  move(node, position, slides) {
    this.motion.set(node, slides ? matrix.fromPose([position, 0, 0], [0, 0, 0, 1])
      : matrix.fromPose([0, 0, 0], [Math.sin(position / 2), 0, 0, Math.cos(position / 2)]));
  }

  /** Works out where every node is. */
  place() {
    this.world = [];
    const visit = (node, above) => {
      const rest = matrix.multiply(above, this.rest[node]);
      this.world[node] = this.motion.has(node) ? matrix.multiply(rest, this.motion.get(node)) : rest;
      for (const child of this.nodes[node].children ?? []) visit(child, this.world[node]);
    };
    visit(0, matrix.identity());
  }

  /** The camera sees everything. */
  fit() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    const take = (point) => point.forEach((value, k) => { low[k] = Math.min(low[k], value); high[k] = Math.max(high[k], value); });
    for (const { node, mesh } of this.parts) {
      for (const part of mesh) {
        for (let corner = 0; corner < 8; ++corner)
          take(matrix.transform(this.world[node], [0, 1, 2].map((k) => (corner >> k & 1 ? part.high : part.low)[k])));
      }
    }
    if (!this.parts.length) this.world.forEach((world) => take(world.slice(12, 15)));
    this.size = Math.max(0.05, Math.hypot(...matrix.minus(high, low)));
    this.camera.at = low.map((value, k) => (value + high[k]) / 2);
    this.camera.distance = 1.45 * this.size;
    this.floor = Math.min(0, low[1]);
    const wished = this.size / 8, tens = 10 ** Math.floor(Math.log10(wished));
    this.cell = tens * (wished < 2 * tens ? 1 : wished < 5 * tens ? 2 : 5);  // 1, 2 or 5 of something, m
  }

  view() {
    const { turn, tilt, distance, at } = this.camera, canvas = this.canvas;
    const away = [Math.cos(tilt) * Math.sin(turn), Math.sin(tilt), Math.cos(tilt) * Math.cos(turn)];
    this.eye = matrix.plus(at, distance, away);
    const lens = matrix.perspective(0.7, canvas.width / Math.max(1, canvas.height), distance / 100, distance * 100);
    return matrix.multiply(lens, matrix.lookAt(this.eye, at));
  }

  resize() {
    const gl = this.gl, scale = Math.min(window.devicePixelRatio, 2);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * scale)), height = Math.max(1, Math.round(this.canvas.clientHeight * scale));
    if (this.canvas.width === width && this.canvas.height === height && this.sized) return;
    this.canvas.width = width;
    this.canvas.height = height;
    this.sized = true;
    for (const [buffer, format] of [[this.pickColour, gl.RGBA8], [this.pickDepth, gl.DEPTH_COMPONENT16]]) {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
    }
  }

  begin({ program, at }, camera) {
    this.gl.useProgram(program);
    this.gl.uniformMatrix4fv(at.camera, false, camera);
  }

  drawFlat(mode, shape, model, colour) {
    const gl = this.gl;
    gl.uniformMatrix4fv(this.flat.at.model, false, model);
    gl.uniform4fv(this.flat.at.colour, colour);
    gl.bindVertexArray(shape.array);
    gl.drawArrays(mode, 0, shape.count);
  }

  drawLit(array, count, model, { colour, roughness, glow }) {
    const gl = this.gl, at = this.lit.at;
    gl.uniformMatrix4fv(at.model, false, model);
    gl.uniform4fv(at.colour, colour);
    gl.uniform1f(at.roughness, roughness);
    gl.uniform1f(at.glow, glow);
    gl.bindVertexArray(array);
    gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
  }

  draw() {
    this.resize();
    const gl = this.gl, camera = this.view(), show = this.show;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0.90, 0.92, 0.945, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.begin(this.flat, camera);
    if (show.grid) this.drawFlat(gl.LINES, this.grid, matrix.scaled(this.cell, [0, this.floor, 0]), [0.76, 0.79, 0.83, 1]);
    this.begin(this.lit, camera);
    gl.uniform3fv(this.lit.at.eye, this.eye);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    for (const clear of [false, true]) {  // what can be seen through comes last
      (clear ? gl.enable : gl.disable).call(gl, gl.BLEND);
      for (const { node, link, mesh } of this.parts) {
        const glow = link === show.hovered ? 0.45 : link === show.chosen ? 0.2 : 0;
        for (const part of mesh) {
          if ((part.colour[3] < 1) === clear) this.drawLit(part.array, part.count, this.world[node], { ...part, glow });
        }
      }
    }
    gl.disable(gl.BLEND);
    for (const target of show.targets) this.drawLit(this.ball.array, this.ball.count, matrix.scaled(target.radius, target.at), { colour: [0.05, 0.5, 0.12, 1], roughness: 0.4, glow: 0 });
    this.begin(this.flat, camera);
    gl.disable(gl.DEPTH_TEST);
    for (const node of show.axes) {
      const model = this.world[node].map((value, i) => (i < 12 ? 0.12 * this.size * value : value));
      this.drawFlat(gl.LINES, { array: this.line, count: 2 }, model, [0.85, 0.1, 0.1, 1]);
    }
    for (const line of this.lines()) {
      const [from, to] = this.ends(line);
      this.drawFlat(gl.LINES, { array: this.line, count: 2 }, [...matrix.minus(to, from), 0, 0, 0, 0, 0, 0, 0, 0, 0, ...from, 1], line.colour);
    }
  }

  /** Lines are of the robot as it was drawn: once a joint has moved they are nowhere. */
  lines() {
    return this.show.still ? this.show.lines : [];
  }

  /** Where a line {at, along, long} begins and ends. */
  ends({ at, along, long }) {
    const half = (long ? 0.5 : 0.2) * this.size;
    return [matrix.plus(at, -half, along), matrix.plus(at, half, along)];
  }

  /** The number of the line nearest to a point of the page, 8 pixels away at most; -1 none. */
  pickLine(x, y) {
    const box = this.canvas.getBoundingClientRect(), camera = this.view();
    const seen = (point) => {
      const [cx, cy, , w] = [0, 1, 2, 3].map((row) => camera[row] * point[0] + camera[4 + row] * point[1] + camera[8 + row] * point[2] + camera[12 + row]);
      return [box.left + box.width * (0.5 + cx / w / 2), box.top + box.height * (0.5 - cy / w / 2)];
    };
    let best = -1, least = 8;
    this.lines().forEach((line, number) => {
      const [a, b] = this.ends(line).map(seen), d = matrix.minus(b, a);
      const t = Math.min(1, Math.max(0, ((x - a[0]) * d[0] + (y - a[1]) * d[1]) / Math.max(1e-9, d[0] ** 2 + d[1] ** 2)));
      const off = Math.hypot(a[0] + t * d[0] - x, a[1] + t * d[1] - y);
      if (off < least) [best, least] = [number, off];
    });
    return best;
  }

  /** The link under a point of the page, or null. */
  pick(x, y) {
    this.resize();
    const gl = this.gl, box = this.canvas.getBoundingClientRect(), scale = this.canvas.width / box.width;
    const column = Math.floor((x - box.left) * scale), row = this.canvas.height - 1 - Math.floor((y - box.top) * scale);
    gl.enable(gl.SCISSOR_TEST);  // one pixel is enough
    gl.scissor(column, row, 1, 1);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picker);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.begin(this.flat, this.view());
    for (const { node, link, mesh } of this.parts) {
      const number = this.links.indexOf(link) + 1;
      gl.uniformMatrix4fv(this.flat.at.model, false, this.world[node]);
      gl.uniform4f(this.flat.at.colour, (number & 255) / 255, (number >> 8) / 255, 0, 1);
      for (const part of mesh) {
        gl.bindVertexArray(part.array);
        gl.drawElements(gl.TRIANGLES, part.count, gl.UNSIGNED_INT, 0);
      }
    }
    const pixel = new Uint8Array(4);
    gl.disable(gl.SCISSOR_TEST);
    gl.readPixels(column, row, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return this.links[pixel[0] + 256 * pixel[1] - 1] ?? null;
  }
}
