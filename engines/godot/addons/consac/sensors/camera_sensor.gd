@icon("res://addons/consac/icon.svg")
class_name ConsacCameraSensor
extends ConsacSensor
## The picture of a SubViewport as bytes, row by row. Text protocol 1 cannot carry it: it needs the native extension.
## [ConsacSync] has it drawn before each observation, so it shows the world as it is. Nothing is drawn with --headless:
## on a server start the engine under Xvfb, or with a graphics card.

## What draws the picture; its size is the entry's.
@export var viewport: SubViewport
## One byte a pixel instead of three.
@export var grey: bool = false


func fault() -> String:
	if viewport == null:
		return "set viewport to the SubViewport that draws the picture"
	if DisplayServer.get_name() == "headless":
		return "nothing is drawn with --headless; start the engine without it, on a server under Xvfb"
	return ""


func entries() -> Array[ConsacEntry]:
	if viewport.render_target_update_mode != SubViewport.UPDATE_ALWAYS and not viewport.get_parent() is SubViewportContainer:
		viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS  # what nobody shows would not be drawn
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


## Called by [ConsacSync] before agents look: draws what sensors see of the world of [param root] as it is now, and the
## window only where [param window_too].
static func draw_now(root: Node, window_too: bool) -> void:
	root.propagate_call(&"force_update_transform")  # what was moved within this tick
	var window := root.get_tree().root.get_viewport_rid()
	var mode := RenderingServer.viewport_get_update_mode(window)
	if not window_too:
		RenderingServer.viewport_set_update_mode(window, RenderingServer.VIEWPORT_UPDATE_DISABLED)
	RenderingServer.force_draw(false)
	RenderingServer.viewport_set_update_mode(window, mode)
