extends Node2D
## Draws the road, the actor and the coin.

const PLACE := 14.0  # pixels from one place to the next
const LEFT := 40.0
const HEIGHT := 230.0  # where the road begins

@onready var _agent: RoadAgent = $Agent


func _process(_delta: float) -> void:
	queue_redraw()


func _draw() -> void:
	var corners := PackedVector2Array([Vector2.ZERO, Vector2(640, 0), Vector2(640, HEIGHT), Vector2(0, HEIGHT)])
	draw_polygon(corners, PackedColorArray([Color("6fa8dc"), Color("6fa8dc"), Color("f3e9d2"), Color("f3e9d2")]))
	draw_circle(Vector2(560, 60), 24.0, Color("fff1b8"))
	for hill: Vector3 in [Vector3(90, 235, 90), Vector3(260, 250, 120), Vector3(460, 240, 105), Vector3(610, 235, 80)]:
		draw_circle(Vector2(hill.x, hill.y), hill.z, Color("9cc49a"))
	draw_rect(Rect2(0, HEIGHT, 640, 160), Color("5f8f5f"))
	draw_rect(Rect2(0, HEIGHT, 640, 30), Color("555b66"))
	for place in range(RoadAgent.FIRST, RoadAgent.LAST + 1):
		draw_rect(Rect2(_x(place) - 4.0, HEIGHT + 13.0, 8.0, 3.0), Color("d8d2c2"))
	var coin := Vector2(_x(_agent.coin), HEIGHT - 6.0)
	draw_circle(coin, 9.0, Color("b8860b"))
	draw_circle(coin, 7.5, Color.GOLD)
	var feet := Vector2(_x(_agent.actor), HEIGHT + 8.0)
	draw_circle(feet + Vector2(0, -1), 9.0, Color(0, 0, 0, 0.25))
	draw_line(feet + Vector2(-3, 0), feet + Vector2(-2, -14), Color("2b3a55"), 4.0)
	draw_line(feet + Vector2(3, 0), feet + Vector2(2, -14), Color("2b3a55"), 4.0)
	draw_rect(Rect2(feet.x - 6.0, feet.y - 32.0, 12.0, 19.0), Color("d1495b"))
	draw_circle(feet + Vector2(0, -39), 7.0, Color("f0c8a0"))


func _x(place: int) -> float:
	return LEFT + PLACE * place
