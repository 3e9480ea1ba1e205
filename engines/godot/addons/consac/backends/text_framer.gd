class_name ConsacTextFramer
extends RefCounted
## Cuts a stream of bytes into the actions of text protocol 1: with newlines, or without any
## (spec/text1.md, Terminators).

const LONGEST := 1 << 20  # bytes of one message
const ENDS: Array[int] = [10, 13, 0]
const DIGITS: Array[int] = [48, 49, 50, 51, 52, 53, 54, 55, 56, 57]

## An action is one digit, so it is complete with it; what begins otherwise ends as any message does.
var single_character := false
## Seconds of silence that end a message without newline.
var quiet_s := 0.002

var _bytes := PackedByteArray()
var _heard_usec := 0


## Forgets everything that came.
func clear() -> void:
	_bytes.clear()


## Bytes that came at [param now_usec]. False when a message is longer than any may be.
func feed(bytes: PackedByteArray, now_usec: int) -> bool:
	_bytes.append_array(bytes)
	_heard_usec = now_usec
	return _bytes.size() <= LONGEST


## The next whole message without what ends it; empty when there is none yet.
func next(now_usec: int) -> PackedByteArray:
	var from := 0
	while from < _bytes.size() and _bytes[from] in ENDS:
		from += 1
	if from > 0:
		_bytes = _bytes.slice(from)
	if _bytes.is_empty():
		return PackedByteArray()
	var length := 1 if single_character and _bytes[0] in DIGITS else _length_of_line()
	if length == 0 and now_usec - _heard_usec >= quiet_s * 1e6:
		length = _bytes.size()
	var message := _bytes.slice(0, length)
	_bytes = _bytes.slice(length)
	return message


# Up to the first end; 0 while there is none.
func _length_of_line() -> int:
	var length := 0
	for end in ENDS:
		var at := _bytes.find(end)
		if at > 0 and (length == 0 or at < length):
			length = at
	return length
