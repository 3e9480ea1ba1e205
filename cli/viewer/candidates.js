// Joint candidates of a CAD file: their axes, one chosen by a click, and hints that take or reject it.

const $ = (id) => document.getElementById(id);
const DEGREES = 180 / Math.PI;

/** A number of a field; undefined where it is empty. */
function numberOf(id) {
  const text = $(id).value.trim();
  if (text === "") return undefined;
  const value = Number(text);
  if (!Number.isFinite(value)) throw new Error(`${text} is no number`);
  return value;
}

export class Candidates {
  constructor({ candidates, hints, file, token, version, error }, scene, draw, ask, fail) {
    Object.assign(this, { candidates, hints, token, version, scene, draw, ask, fail });
    $("candidates").hidden = false;
    $("hint-file").textContent = error ? `${file}: ${error}` : file ? `written to ${file}` : "--hints FILE lets them be taken and rejected here";
    this.rows = candidates.map((candidate, number) => this.row(candidate, number));
    scene.show.lines = candidates.map(({ origin: [x, y, z], direction: [dx, dy, dz], score }) =>
      ({ at: [x, z, -y], along: [dx, dz, -dy], colour: this.colour(score), long: false }));
    $("hint-type").addEventListener("change", () => this.showUnit());
    $("hint").addEventListener("submit", (event) => {
      event.preventDefault();
      this.say(() => this.taken());
    });
    $("hint-reject").addEventListener("click", () => this.say(() => this.rejected()));
    draw();
  }

  /** Red to green. */
  colour(score) {
    return [0.85 * (1 - score), 0.6 * score, 0.1, 1];
  }

  row({ kind, score, first, second, verdict, reason }, number) {
    const row = document.createElement("button"), [red, green, blue] = this.colour(score).map((value) => Math.round(255 * value));
    row.type = "button";
    row.textContent = `${score.toFixed(2)} ${kind}: ${first} – ${second} (${verdict})`;
    row.title = reason;
    row.style.setProperty("--score", `rgb(${red} ${green} ${blue})`);
    row.addEventListener("click", () => this.choose(number));
    $("list").append(row);
    return row;
  }

  choose(number) {
    this.chosen = this.candidates[number];
    this.rows.forEach((row, i) => row.classList.toggle("chosen", i === number));
    this.rows[number].scrollIntoView({ block: "nearest" });
    this.scene.show.lines.forEach((line, i) => {
      line.long = i === number;
      line.colour = i === number ? [0.1, 0.3, 0.95, 1] : this.colour(this.candidates[i].score);
    });
    $("hint").hidden = !this.token;
    $("hint-child").replaceChildren(...[this.chosen.second, this.chosen.first].map((name) => new Option(name, name)));
    const said = this.joints().find((joint) => this.isOf(joint)) ?? {};
    $("hint-name").value = said.name ?? (this.chosen.kind === "turns" && !/ /.test(this.chosen.verdict) ? this.chosen.verdict : `joint_${number + 1}`);
    $("hint-type").value = said.type && said.type !== "fixed" ? said.type : "revolute";
    const scale = $("hint-type").value === "prismatic" ? 1000 : DEGREES;
    ["hint-lower", "hint-upper"].forEach((id, i) => { $(id).value = said.limit ? String(+(said.limit[i] * scale).toFixed(6)) : ""; });
    if (said.child) $("hint-child").value = said.child;
    this.showUnit();
    this.draw();
  }

  showUnit() {
    $("hint-unit").textContent = $("hint-type").value === "prismatic" ? "mm" : "°";
    $("hint-limits").hidden = $("hint-type").value === "continuous";
  }

  joints() {
    return this.hints.joints ?? [];
  }
  isOf({ parent, child }) {
    const { first, second } = this.chosen;
    return parent === first && child === second || parent === second && child === first;
  }
  ends() {
    const child = $("hint-child").value;
    return { parent: child === this.chosen.first ? this.chosen.second : this.chosen.first, child };
  }

  taken() {
    const type = $("hint-type").value, scale = type === "prismatic" ? 1000 : DEGREES, { origin, direction } = this.chosen;
    const lower = numberOf("hint-lower"), upper = numberOf("hint-upper");
    const limited = type !== "continuous" && (lower !== undefined || upper !== undefined);
    if (limited && (lower === undefined || upper === undefined)) throw new Error("both limits are needed, or none");
    return { name: $("hint-name").value, type, ...this.ends(), axis: { origin, direction }, ...(limited ? { limit: [lower / scale, upper / scale] } : {}) };
  }
  rejected() {
    return { name: $("hint-name").value, type: "fixed", ...this.ends() };
  }

  /** Saves what `make` says of the chosen pair; the page begins anew with what came of it. */
  async say(make) {
    try {
      const joints = [...this.joints().filter((joint) => !this.isOf(joint)), make()];
      await this.ask("/hints", { token: this.token, version: this.version, hints: { ...this.hints, joints } });
      location.reload();
    } catch (error) {
      this.fail(error);
    }
  }
}
