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
