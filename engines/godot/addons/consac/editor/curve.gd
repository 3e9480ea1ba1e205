@tool
extends Control
## A curve that grows while it is looked at: one number over the steps of a training.

const MARGIN := 6.0

## Above the curve.
var title := "":
	set(value):
		title = value
		queue_redraw()

## Up to which step numbers were told, though perhaps not this one.
var told_at := 0.0

var _points := PackedVector2Array()


func _init() -> void:
	custom_minimum_size = Vector2(160, 130)
	size_flags_vertical = Control.SIZE_EXPAND_FILL


## The next point.
func add(steps: float, value: float) -> void:
	_points.append(Vector2(steps, value))
	queue_redraw()


## How many there are.
func count() -> int:
	return _points.size()


## What stands below: the newest number, or that it was not told of late.
func caption() -> String:
	if _points.is_empty():
		return ""
	var value := String.num(_points[-1].y, 3)
	if _points[-1].x < told_at:
		return "%d steps, nothing new since %s at %d" % [told_at, value, _points[-1].x]
	return "%d steps, now %s" % [_points[-1].x, value]


## Begins anew.
func clear() -> void:
	_points.clear()
	queue_redraw()


func _draw() -> void:
	var font := get_theme_default_font()
	var font_size := get_theme_default_font_size() - 2
	var text := get_theme_color(&"font_color", &"Label")
	var box := Rect2(Vector2.ZERO, size)
	draw_rect(box, get_theme_color(&"dark_color_2", &"Editor"))
	draw_string(font, Vector2(MARGIN, MARGIN + font_size), title, HORIZONTAL_ALIGNMENT_LEFT, -1, font_size, text)
	if _points.is_empty():
		return
	var low := _points[0].y
	var high := _points[0].y
	for point in _points:
		low = minf(low, point.y)
		high = maxf(high, point.y)
	var span := maxf(high - low, 1e-9)
	var room := Rect2(MARGIN, 2.0 * MARGIN + font_size, size.x - 2.0 * MARGIN, size.y - 4.0 * MARGIN - 2.0 * font_size)
	var last := maxf(maxf(_points[-1].x, told_at), 1.0)
	var line := PackedVector2Array()
	for point in _points:
		line.append(Vector2(room.position.x + room.size.x * point.x / last, room.end.y - room.size.y * (point.y - low) / span))
	if line.size() > 1:
		draw_polyline(line, get_theme_color(&"accent_color", &"Editor"), 2.0, true)
	draw_circle(line[-1], 3.5, get_theme_color(&"accent_color", &"Editor"))
	var dim := Color(text, 0.6)
	draw_string(font, Vector2(MARGIN, room.position.y + font_size), String.num(high, 2), HORIZONTAL_ALIGNMENT_LEFT, -1, font_size, dim)
	draw_string(font, Vector2(MARGIN, room.end.y), String.num(low, 2), HORIZONTAL_ALIGNMENT_LEFT, -1, font_size, dim)
	draw_string(font, Vector2(MARGIN, size.y - MARGIN), caption(),
			HORIZONTAL_ALIGNMENT_RIGHT, size.x - 2.0 * MARGIN, font_size, text)
