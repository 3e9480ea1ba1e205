class_name ConsacValues
extends RefCounted
## From what an agent's script says to rows of numbers: what [ConsacAgent] is given by name, checked against its entries.
## What does not fit is one sentence, which names entry, value and what was expected.


## What is wrong with entries of [param role] ("observation" or "action"), after the agent's name; "" when nothing is.
static func fault_of(entries: Array[ConsacEntry], role: String) -> String:
	if entries.is_empty():
		return " has no %s entries; add one in the inspector" % role
	var seen := {}
	for entry in entries:
		var fault := "an entry is empty" if entry == null else entry.fault()
		if fault.is_empty() and role == "action" and entry.kind == ConsacEntry.Kind.IMAGE:
			fault = "entry '%s' is an image; an agent acts by numbers and choices" % entry.name
		if fault.is_empty() and seen.has(entry.name):
			fault = "two entries are named '%s'" % entry.name
		if not fault.is_empty():
			return ", %ss: %s" % [role, fault]
		seen[entry.name] = true
	return ""


## What an agent needs of its entries at every step, so that it need not ask them each time: fills [param names], and [param
## widths] with how many numbers each has (-1 for a choice). How many numbers they have together.
static func plan(entries: Array[ConsacEntry], names: Array[StringName], widths: PackedInt32Array) -> int:
	names.clear()
	widths.clear()
	var sum := 0
	for entry in entries:
		if entry != null:
			names.append(entry.name)
			widths.append(-1 if entry.kind == ConsacEntry.Kind.DISCRETE else entry.numbers())
			sum += entry.numbers()
	return sum


## Puts [param value] into the row [param into] from number [param at] on; a picture stays where it is. What does not fit, or
## ""; [param source] says whose value it is, as in "observe()".
static func store(into: PackedFloat32Array, at: int, entry: ConsacEntry, value: Variant, source: String) -> String:
	if entry.kind == ConsacEntry.Kind.IMAGE:
		return _fault_of_image(entry, value, source)
	var given := 0
	match typeof(value):
		TYPE_FLOAT, TYPE_INT, TYPE_BOOL:
			given = 1
			into[at] = float(value)
		TYPE_VECTOR2, TYPE_VECTOR3, TYPE_VECTOR4, TYPE_QUATERNION:
			given = 2 if value is Vector2 else (3 if value is Vector3 else 4)
		TYPE_ARRAY, TYPE_PACKED_FLOAT32_ARRAY, TYPE_PACKED_FLOAT64_ARRAY, TYPE_PACKED_INT32_ARRAY:
			given = value.size()
		_:
			return "%s gave %s for entry '%s', expected numbers" % [source, _kind_of(value), entry.name]
	if given != entry.numbers():
		return "%s gave %d numbers for entry '%s', expected %d" % [source, given, entry.name, entry.numbers()]
	if value is Array:
		for i in given:
			if not typeof(value[i]) in [TYPE_FLOAT, TYPE_INT, TYPE_BOOL]:
				return "%s gave %s in number %d of entry '%s', expected numbers" % [source, _kind_of(value[i]), i, entry.name]
			into[at + i] = float(value[i])
	elif typeof(value) > TYPE_FLOAT:
		for i in given:
			into[at + i] = value[i]
	if entry.kind == ConsacEntry.Kind.DISCRETE and not (into[at] >= 0.0 and into[at] < entry.choices):
		return "%s gave %s for entry '%s', expected 0 to %d" % [source, into[at], entry.name, entry.choices - 1]
	return ""


## What is wrong with a mask for the choices of [param entry], or "".
static func fault_of_mask(legal: Variant, entry: ConsacEntry) -> String:
	if not legal is PackedByteArray or legal.size() != entry.choices:
		return "mask() gave %s for action '%s', expected a PackedByteArray of %d" % [
				_kind_of(legal) if not legal is PackedByteArray else "%d bytes" % legal.size(), entry.name, entry.choices]
	if legal.count(0) == legal.size():
		return "mask() leaves no legal choice for action '%s'; one at least must be" % entry.name
	return ""


## A mask that leaves every choice of [param entry] legal.
static func everything(entry: ConsacEntry) -> PackedByteArray:
	var legal := PackedByteArray()
	legal.resize(entry.choices)
	legal.fill(1)
	return legal


static func _fault_of_image(entry: ConsacEntry, value: Variant, source: String) -> String:
	var expected := entry.height * entry.width * entry.channels
	var given := _kind_of(value)
	if value is PackedByteArray:
		if value.size() == expected:
			return ""
		given = "%d bytes" % value.size()
	return "%s gave %s for entry '%s', expected a PackedByteArray of %d (%d x %d x %d)" % [
			source, given, entry.name, expected, entry.height, entry.width, entry.channels]


static func _kind_of(value: Variant) -> String:
	return "nothing" if value == null else "a " + type_string(typeof(value))
