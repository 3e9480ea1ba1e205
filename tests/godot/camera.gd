extends SceneTree
## Checks the camera sensor where something is drawn, run by test_wire.py under Xvfb.


func _initialize() -> void:
	_run.call_deferred()


func _run() -> void:
	var viewport := SubViewport.new()
	viewport.size = Vector2i(8, 4)
	viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	var half := ColorRect.new()
	half.color = Color.RED
	half.size = Vector2(4, 4)
	viewport.add_child(half)
	var sensor := ConsacCameraSensor.new()
	sensor.viewport = viewport
	root.add_child(viewport)
	for frame in 3:
		await process_frame
	var into := {}
	sensor.sense(into)
	var bytes: PackedByteArray = into[sensor.entry_name]
	var entry := sensor.entries()[0]
	print("camera: ", bytes.size(), " of ", entry.width * entry.height * entry.channels)
	print("camera: first ", Array(bytes.slice(0, 3)), ", last ", bytes[-3])
	sensor.free()
	quit()
