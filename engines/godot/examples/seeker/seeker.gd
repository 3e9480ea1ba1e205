extends Node3D
## Carries the eye along with the robot, and shows on the screen what it sees.

@onready var _eye: Camera3D = $Sight/Eye
@onready var _head: Node3D = $Robot/Head


func _ready() -> void:
	$Screen/Picture.texture = $Sight.get_texture()


func _physics_process(_delta: float) -> void:
	_eye.global_transform = _head.global_transform
