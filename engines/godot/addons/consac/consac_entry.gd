@icon("res://addons/consac/icon.svg")
class_name ConsacEntry
extends Resource
## One named thing that an agent observes or does: some numbers, or one of several choices.

## What an entry holds.
enum Kind {
	BOX,  ## [member size] numbers from [member low] to [member high]
	DISCRETE,  ## one whole number from 0 to [member choices] - 1
	IMAGE,  ## bytes, [member height] x [member width] x [member channels]; needs the native extension (protocol 2)
}

## Most numbers, or choices, of one entry.
const MOST := 65536

## Under which the agent's methods find it; no two entries of an agent share a name.
@export var name: StringName = &""
## What it holds.
@export var kind: Kind = Kind.BOX
## BOX: how many numbers.
@export_range(1, MOST) var size: int = 1
## BOX: the least that each number can be.
@export var low: float = -1.0
## BOX: the most that each number can be.
@export var high: float = 1.0
## DISCRETE: how many choices.
@export_range(1, MOST) var choices: int = 2
## IMAGE: pixels from left to right.
@export_range(1, 4096) var width: int = 84
## IMAGE: pixels from top to bottom.
@export_range(1, 4096) var height: int = 84
## IMAGE: bytes a pixel.
@export_range(1, 4) var channels: int = 3


## An entry of [param count] numbers.
static func box(entry_name: StringName, count: int, lowest := -1.0, highest := 1.0) -> ConsacEntry:
	var entry := ConsacEntry.new()
	entry.name = entry_name
	entry.size = count
	entry.low = lowest
	entry.high = highest
	return entry


## An entry that is one of [param count] choices.
static func discrete(entry_name: StringName, count: int) -> ConsacEntry:
	var entry := ConsacEntry.new()
	entry.name = entry_name
	entry.kind = Kind.DISCRETE
	entry.choices = count
	return entry


## An entry of pixels.
static func image(entry_name: StringName, pixels: Vector2i, bytes_a_pixel: int) -> ConsacEntry:
	var entry := ConsacEntry.new()
	entry.name = entry_name
	entry.kind = Kind.IMAGE
	entry.width = pixels.x
	entry.height = pixels.y
	entry.channels = bytes_a_pixel
	return entry


## How many numbers it takes in a row: those of a box, one for a choice, none for an image, which
## has bytes of its own.
func numbers() -> int:
	match kind:
		Kind.BOX:
			return size
		Kind.DISCRETE:
			return 1
	return 0


## The middle of a box's range; where it has no end, 0 or what is nearest to it.
func middle() -> float:
	if is_finite(low) and is_finite(high):
		return low + (high - low) / 2.0
	return clampf(0.0, low, high)


## Entries as the native classes take them.
static func tables(entries: Array[ConsacEntry]) -> Array[Dictionary]:
	var all: Array[Dictionary] = []
	for entry in entries:
		match entry.kind:
			Kind.BOX:
				all.append({name = entry.name, type = "box", shape = [entry.size], low = entry.low, high = entry.high})
			Kind.DISCRETE:
				all.append({name = entry.name, type = "discrete", n = entry.choices})
			Kind.IMAGE:
				all.append({
					name = entry.name, type = "box", dtype = "uint8",
					shape = [entry.height, entry.width, entry.channels]})
	return all


## The same for a model that has [param known] entries: one that was learned over text protocol 1 knows one row of
## numbers without a name.
static func tables_for(entries: Array[ConsacEntry], known: Array) -> Array[Dictionary]:
	var nameless: bool = known.size() == 1 and known[0].name.is_empty() and known[0].type == "box"
	if not nameless or entries.size() < 2:
		return tables(entries)
	var lows := PackedFloat64Array()
	var highs := PackedFloat64Array()
	for entry in entries:
		for i in entry.numbers():
			lows.append(entry.low)
			highs.append(entry.high)
	var all: Array[Dictionary] = []
	all.append({name = "numbers", type = "box", shape = [lows.size()], low = lows, high = highs})
	return all


## What is wrong with it, in one sentence; "" when nothing is.
func fault() -> String:
	if name == &"":
		return "an entry has no name"
	if kind == Kind.BOX and (size < 1 or size > MOST):
		return "entry '%s' has size %d, expected 1 to %d" % [name, size, MOST]
	if kind == Kind.BOX and not low <= high:
		return "entry '%s' has low %s above high %s" % [name, low, high]
	if kind == Kind.DISCRETE and (choices < 1 or choices > MOST):
		return "entry '%s' has %d choices, expected 1 to %d" % [name, choices, MOST]
	return ""
