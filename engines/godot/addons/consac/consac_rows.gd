class_name ConsacRows
extends RefCounted
## Agents of the same entries, for whoever chooses for all of them at once: a row each, in the order of [member agents].
## Of a native world's behaviour, and of a model that several play by.

## A row's agent; null is a free row, which observes zeros and darkness and may do everything.
var agents: Array[ConsacAgent] = []
## Numbers of an action.
var numbers := 0
## Image entries, in order.
var images: Array[StringName] = []
## Numbers of an observation.
var width: int:
	get: return _nothing.size()

var _nothing := PackedFloat32Array()  # what a free row observes
var _darkness := PackedByteArray()  # and its images
var _liberty := PackedByteArray()  # and what is legal for it; empty where nothing is masked


## The form of the rows is that of [param agent], which is prepared.
func take_form(agent: ConsacAgent) -> void:
	numbers = agent.action_row.size()
	_nothing.resize(agent.row.size())
	var choices := 0
	for entry in agent.actions:
		if agent.masks_actions and entry.kind == ConsacEntry.Kind.DISCRETE:
			choices += entry.choices
	_liberty.resize(choices)
	_liberty.fill(1)
	for entry in agent.all_observations:
		if entry.kind == ConsacEntry.Kind.IMAGE:
			images.append(entry.name)
			_darkness.resize(_darkness.size() + entry.height * entry.width * entry.channels)


## Numbers that all observe, row after row.
func observations() -> PackedFloat32Array:
	if agents.size() == 1 and agents[0] != null:
		return agents[0].row
	var rows := PackedFloat32Array()
	for agent in agents:
		rows.append_array(_nothing if agent == null else agent.row)
	return rows


## Bytes of their pictures, likewise.
func pictures() -> PackedByteArray:
	var bytes := PackedByteArray()
	if images.is_empty():
		return bytes
	for agent in agents:
		bytes.append_array(_darkness if agent == null else agent.image_bytes(agent.values, images))
	return bytes


## A byte for each choice that is legal for them, likewise; empty where nothing is masked.
func masks() -> PackedByteArray:
	var bytes := PackedByteArray()
	if _liberty.is_empty():
		return bytes
	for agent in agents:
		bytes.append_array(_liberty if agent == null else agent.mask_row)
	return bytes


## Gives each its action of [param rows].
func hand_out(rows: PackedFloat32Array) -> void:
	for i in agents.size():
		if agents[i] != null:
			agents[i].action_row = rows.slice(i * numbers, (i + 1) * numbers)
