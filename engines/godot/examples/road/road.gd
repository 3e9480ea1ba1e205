extends Node2D
## Draws the road, the actor and the coin.

const PLACE := 14.0  # pixels from one place to the next
const LEFT := 40.0
const HEIGHT := 200.0

@onready var _agent: RoadAgent = $Agent


func _process(_delta: float) -> void:
	queue_redraw()


func _draw() -> void:
	for place in range(RoadAgent.FIRST, RoadAgent.LAST + 1):
		draw_rect(Rect2(_x(place) - 6.0, HEIGHT, 12.0, 8.0), Color.SLATE_GRAY)
	draw_circle(Vector2(_x(_agent.coin), HEIGHT - 14.0), 7.0, Color.GOLD)
	draw_rect(Rect2(_x(_agent.actor) - 6.0, HEIGHT - 28.0, 12.0, 28.0), Color.MEDIUM_SEA_GREEN)


func _x(place: int) -> float:
	return LEFT + PLACE * place
