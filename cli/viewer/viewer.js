// The page: sliders, the pose that the program computes, the mouse, a model that plays.
import { Scene } from "/scene.js";
import { Candidates } from "/candidates.js";
import { plus, cross, unit, minus } from "/matrix.js";

const $ = (id) => document.getElementById(id);
const DEGREES = 180 / Math.PI;
const WITHOUT_LIMIT = { turns: Math.PI, slides: 1 };  // rad, m: how far a slider goes where a joint has no limit

let failed = "";  // the path whose error is shown

/** Asks the program; an answer that is none is shown, until the same question has one. */
async function ask(path, body) {
  const options = body === undefined ? {} : { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
  try {
    const response = await fetch(path, options);
    if (!response.ok) throw new Error(`${path}: ${(await response.text()).trim()}`);
    if (failed === path) $("error").hidden = true;
    return response;
  } catch (error) {
    failed = path;
    throw error;
  }
}

function fail(error) {
  $("error").textContent = String(error.message ?? error);
  $("error").hidden = false;
}

/** One robot on the page. */
class Page {
  constructor(table, glb) {
    this.table = table;
    this.moving = table.joints.filter((joint) => joint.type !== "fixed");
    this.leaders = this.moving.filter((joint) => !joint.mimic);
    this.positions = new Map(this.leaders.map((joint) => [joint.name, this.zero(joint)]));
    const links = new Map([[0, table.root], ...table.joints.map((joint) => [joint.node_index, joint.child])]);
    this.scene = new Scene($("scene"), glb, links);
    this.poses = [];
    this.asking = this.stale = false;
    this.showTexts();
    this.makeSliders();
    this.listen();
    this.choose(table.end_effectors[0] ?? table.root);
    this.moved();
    this.scene.fit();
  }

  limits(joint) {
    const free = joint.type === "prismatic" ? WITHOUT_LIMIT.slides : WITHOUT_LIMIT.turns;
    return [joint.lower ?? -free, joint.upper ?? free];
  }
  zero(joint) {
    const [lower, upper] = this.limits(joint);
    return Math.min(Math.max(0, lower), upper);
  }
  unit(joint) {
    return joint.type === "prismatic" ? { scale: 1000, name: "mm" } : { scale: DEGREES, name: "°" };
  }

  showTexts() {
    const { name, links, joints, end_effectors: ends, root } = this.table;
    document.title = `${name} · consac twin`;
    $("name").textContent = name;
    $("summary").textContent = `${links.length} links, ${joints.length} joints, ${this.leaders.length} of them move by themselves`;
    const others = links.map((link) => link.name).filter((link) => !ends.includes(link) && link !== root);
    for (const link of [...ends, ...others, root]) $("link").append(new Option(link, link));
  }

  makeSliders() {
    this.rows = new Map();
    for (const joint of this.moving) {
      const row = document.createElement("div"), name = document.createElement("span"), value = document.createElement("output");
      row.className = joint.mimic ? "joint follows" : "joint";
      name.textContent = joint.mimic ? `${joint.name} follows ${joint.mimic.joint}` : joint.name;
      row.append(name, value);
      let slider = null;
      if (!joint.mimic) {
        const [lower, upper] = this.limits(joint), { scale, name: unitName } = this.unit(joint), ends = document.createElement("small");
        slider = Object.assign(document.createElement("input"), { type: "range", id: `joint ${joint.name}`, step: "any" });
        slider.min = lower * scale;
        slider.max = upper * scale;
        slider.setAttribute("aria-label", joint.name);
        slider.addEventListener("input", () => {
          this.positions.set(joint.name, Number(slider.value) / scale);
          this.moved(joint);
        });
        for (const [end, said] of [[lower, joint.lower], [upper, joint.upper]]) {
          const text = document.createElement("span");
          text.textContent = said === null ? "no limit" : `${(end * scale).toFixed(1)}${unitName}`;
          ends.append(text);
        }
        row.append(slider, ends);
      }
      $("joints").append(row);
      this.rows.set(joint.name, { value, slider });
    }
  }

  position(joint) {
    return joint.mimic ? joint.mimic.multiplier * this.positions.get(joint.mimic.joint) + joint.mimic.offset : this.positions.get(joint.name);
  }

  /** The positions have changed, by `by`'s slider if there is one: draws them, and asks the program for the pose. */
  moved(by) {
    for (const joint of this.moving) {
      const position = this.position(joint), { scale, name } = this.unit(joint), { value, slider } = this.rows.get(joint.name);
      value.textContent = `${(position * scale).toFixed(1)}${name}`;
      if (slider && joint !== by) slider.value = position * scale;
      this.scene.move(joint.node_index, position, joint.type === "prismatic");
    }
    this.scene.show.still = this.leaders.every((joint) => this.positions.get(joint.name) === this.zero(joint));
    this.scene.place();
    this.draw();
    this.askPose();
  }

  /** One question at a time; the latest positions are always asked for in the end. */
  async askPose() {
    if (this.asking) {
      this.stale = true;
      return;
    }
    this.asking = true;
    do {
      this.stale = false;
      const asked = this.leaders.map((joint) => this.positions.get(joint.name));
      try {
        this.poses = await (await ask("/pose", { positions: asked })).json();
        this.showPose(asked);
      } catch (error) {
        fail(error);
      }
    } while (this.stale);
    this.asking = false;
  }

  showPose(asked) {
    const pose = this.poses.find((row) => row.link === this.chosen);
    if (!pose) return;
    const text = (numbers, digits) => numbers.map((value) => value.toFixed(digits).padStart(digits + 4)).join(" ");
    $("position").textContent = text(pose.position, 4);
    $("rotation").textContent = text(pose.rotation, 3);
    $("rpy").textContent = text(pose.rpy.map((angle) => angle * DEGREES), 2);
    $("pose").dataset.exact = JSON.stringify({ ...pose, positions: asked ?? JSON.parse($("pose").dataset.exact).positions });
  }

  choose(link) {
    this.chosen = this.scene.show.chosen = link;
    $("link").value = link;
    this.showPose();
    this.draw();
  }

  draw() {
    if (this.due) return;
    this.due = requestAnimationFrame(() => {
      this.due = 0;
      this.scene.draw();
    });
  }

  listen() {
    $("link").addEventListener("change", () => this.choose($("link").value));
    $("grid").addEventListener("change", () => { this.scene.show.grid = $("grid").checked; this.draw(); });
    $("axes").addEventListener("change", () => {
      this.scene.show.axes = $("axes").checked ? this.moving.map((joint) => joint.node_index) : [];
      this.draw();
    });
    $("reset").addEventListener("click", () => {
      for (const joint of this.leaders) this.positions.set(joint.name, this.zero(joint));
      this.moved();
    });
    new ResizeObserver(() => this.draw()).observe($("scene"));
    this.listenToMouse();
  }

  listenToMouse() {
    const canvas = $("scene"), camera = this.scene.camera;
    let from = null, still = true;
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      from = [event.clientX, event.clientY];
      still = true;
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!from) return this.hover(event.clientX, event.clientY);
      const dx = event.clientX - from[0], dy = event.clientY - from[1];
      if (still && Math.hypot(dx, dy) < 3) return;
      still = false;
      $("hover").hidden = true;
      from = [event.clientX, event.clientY];
      if (event.shiftKey || event.buttons & 2) {
        const far = camera.distance / canvas.clientHeight, ahead = unit(minus(camera.at, this.scene.eye));
        const right = unit(cross(ahead, [0, 1, 0])), up = cross(right, ahead);
        camera.at = plus(plus(camera.at, -dx * far, right), dy * far, up);
      } else {
        camera.turn -= 0.008 * dx;
        camera.tilt = Math.min(1.55, Math.max(-1.55, camera.tilt + 0.008 * dy));
      }
      this.draw();
    });
    canvas.addEventListener("pointerup", (event) => {
      const line = still ? this.scene.pickLine(event.clientX, event.clientY) : -1;
      const link = still && line < 0 ? this.scene.pick(event.clientX, event.clientY) : null;
      from = null;
      if (line >= 0) this.candidates.choose(line);
      if (link) this.choose(link);
    });
    canvas.addEventListener("pointercancel", () => { from = null; });
    canvas.addEventListener("pointerleave", () => this.hover(-1, -1));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      camera.distance = Math.min(20 * this.scene.size, Math.max(0.02 * this.scene.size, camera.distance * Math.exp(0.0012 * event.deltaY)));
      this.draw();
    }, { passive: false });
  }

  hover(x, y) {
    const link = x < 0 ? null : this.scene.pick(x, y), box = $("scene").getBoundingClientRect();
    $("hover").hidden = !link;
    $("hover").textContent = link ?? "";
    $("hover").style.left = `${x - box.left + 14}px`;
    $("hover").style.top = `${y - box.top + 10}px`;
    if (this.scene.show.hovered === link) return;
    this.scene.show.hovered = link;
    this.draw();
  }

  /** A model plays, where the program was given one. */
  async listenToModel() {
    const state = await (await ask("/play")).json();
    if (!state) return;
    $("play").hidden = false;
    this.showPlay(state);
    for (const [button, what] of [["start", "start"], ["pause", "pause"], ["again", "reset"]]) {
      $(button).addEventListener("click", async () => {
        try {
          this.showPlay(await (await ask("/play", { do: what })).json());
          if (what === "start") this.follow();
        } catch (error) {
          fail(error);
        }
      });
    }
  }

  /** Asks how the robot stands for as long as it is moved; once more where a start came while an answer was awaited. */
  async follow() {
    this.started = true;
    if (this.following) return;
    this.following = true;
    try {
      while (this.started) {
        this.started = false;
        const state = await (await ask("/play")).json();
        this.showPlay(state);
        if (!state.running) continue;
        this.started = true;
        await new Promise(requestAnimationFrame);
      }
    } catch (error) {
      fail(error);
    }
    this.following = false;
  }

  showPlay({ world, running, episode, step, reward, joints, targets, tools }) {
    const off = Math.max(...targets.map((target, i) => Math.hypot(...minus(target, tools[i]))));
    $("told").textContent = `${world}: ${running ? "plays" : "stands"}, episode ${episode}, step ${step}, reward ${reward.toFixed(2)}, ${(1000 * off).toFixed(0)} mm from its target`;
    this.scene.show.targets = targets.map(([x, y, z]) => ({ at: [x, z, -y], radius: 0.02 }));
    for (const [name, position] of Object.entries(joints)) this.positions.set(name, position);
    this.moved();
  }
}

try {
  const [table, glb] = await Promise.all([ask("/twin.json").then((answer) => answer.json()), ask("/twin.glb").then((answer) => answer.arrayBuffer())]);
  const page = new Page(table, glb);
  const candidates = await (await ask("/candidates")).json();
  if (candidates) page.candidates = new Candidates(candidates, page.scene, () => page.draw(), ask, fail);
  await page.listenToModel();
  document.body.dataset.ready = "yes";
} catch (error) {
  fail(error);
}
