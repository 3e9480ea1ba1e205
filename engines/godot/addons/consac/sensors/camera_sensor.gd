@icon("res://addons/consac/icon.svg")
class_name ConsacCameraSensor
extends ConsacSensor
## The picture of a SubViewport as bytes, row by row. Text protocol 1 cannot carry it: it needs the
## native extension. A picture is drawn with a frame, so it shows the world as of the latest frame,
## and none is drawn with --headless.

## What draws the picture; its size is the entry's.
@export var viewport: SubViewport
## One byte a pixel instead of three.
@export var grey: bool = false


func entries() -> Array[ConsacEntry]:
	return [ConsacEntry.image(entry_name, viewport.size, 1 if grey else 3)]


func sense(into: Dictionary) -> void:
	var image := viewport.get_texture().get_image()
	if image == null or image.is_empty():
		var nothing := PackedByteArray()
		nothing.resize(viewport.size.x * viewport.size.y * (1 if grey else 3))
		into[entry_name] = nothing
		return
	image.convert(Image.FORMAT_L8 if grey else Image.FORMAT_RGB8)
	into[entry_name] = image.get_data()
