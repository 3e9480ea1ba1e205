extends Node2D
## Rays and grids with a wall ahead, in 2D and in 3D; saves a picture and counts what is drawn.

const PICTURE := ""
const DRAWN := true

var grids := {}


class Senses:
	extends ConsacAgent

	func _init() -> void:
		actions = [ConsacEntry.discrete(&"nothing", 2)]

	func look() -> String:
		var fault := super()
		for name: StringName in [&"grid_2d", &"grid_3d"]:
			var cells := []
			for i in values[name].size():
				if values[name][i] > 0.0:
					cells.append(i)
			get_parent().grids[name] = cells
		return fault


func _ready() -> void:
	RenderingServer.set_default_clear_color(Color.BLACK)
	var eye_2d := Node2D.new()
	eye_2d.position = Vector2(320, 180)
	eye_2d.rotation = -PI / 2.0  # looks up
	var eye_3d := Node3D.new()
	_wall(StaticBody2D.new(), CollisionShape2D.new(), RectangleShape2D.new(), Vector2(320, 80))
	_wall(StaticBody2D.new(), CollisionShape2D.new(), RectangleShape2D.new(), Vector2(420, 180))
	_wall(StaticBody3D.new(), CollisionShape3D.new(), BoxShape3D.new(), Vector3(0, 0, -2))
	var agent := Senses.new()
	var rays := ConsacRaySensor2D.new()
	rays.body = eye_2d
	rays.length = 150.0
	rays.spread_deg = 180.0
	rays.entry_name = &"rays"
	var grid_2d := ConsacGridSensor2D.new()
	grid_2d.origin = eye_2d
	grid_2d.cell_size = 90.0
	grid_2d.entry_name = &"grid_2d"
	var grid_3d := ConsacGridSensor3D.new()
	grid_3d.origin = eye_3d
	grid_3d.cell_size = 2.0
	grid_3d.entry_name = &"grid_3d"
	for sensor: ConsacSensor in [rays, grid_2d, grid_3d]:
		sensor.drawn = DRAWN and sensor != grid_3d
		if sensor is ConsacGridSensor:
			sensor.cells = Vector2i(3, 3)
			sensor.classes.append(&"wall")
		agent.add_child(sensor)
	var sync := ConsacSync.new()
	sync.show_budget = false
	sync.session_ended.connect(_look.unbind(1))
	for node: Node in [eye_2d, eye_3d, agent, sync]:
		add_child(node)


func _wall(wall: Node, shape: Node, form: Resource, where: Variant) -> void:
	form.size = Vector2(40, 40) if form is RectangleShape2D else Vector3.ONE
	shape.shape = form
	wall.add_child(shape)
	wall.position = where
	wall.add_to_group(&"wall")
	add_child(wall)


func _look() -> void:
	await RenderingServer.frame_post_draw
	var image := get_viewport().get_texture().get_image()
	if PICTURE != "":
		image.save_png(PICTURE)
	var red := 0
	var blue := 0
	for y in image.get_height():
		for x in image.get_width():
			var pixel := image.get_pixel(x, y)
			red += 1 if pixel.r > 0.5 and pixel.b < 0.4 and pixel.g < 0.5 else 0
			blue += 1 if pixel.b > 0.2 and pixel.r < pixel.b else 0
	print("sensing: grid 2D %s, grid 3D %s" % [grids[&"grid_2d"], grids[&"grid_3d"]])
	print("sensing: %d pixels of rays that hit, %d of others" % [red, blue])
	get_tree().quit()
