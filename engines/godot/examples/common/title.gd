extends CanvasLayer
## A title and a line below it, at the lower edge of an example.

## What the example is called.
@export var title: String = ""
## What is to be seen in it.
@export var line: String = ""


func _ready() -> void:
	_write(title, 22, 50.0, 0.95)
	_write(line, 12, 24.0, 0.7)


func _write(text: String, size: int, above: float, opacity: float) -> void:
	var label := Label.new()
	label.text = text
	label.position = Vector2(10.0, get_viewport().get_visible_rect().size.y - above)
	label.add_theme_font_size_override(&"font_size", size)
	label.add_theme_color_override(&"font_color", Color(1, 1, 1, opacity))
	label.add_theme_color_override(&"font_outline_color", Color(0.05, 0.07, 0.1, 0.8))
	label.add_theme_constant_override(&"outline_size", 4)
	add_child(label)
