@tool
class_name ConsacModelLoader
extends ResourceFormatLoader
## Makes [code].consac[/code] files resources: they can be loaded, dragged onto a property, and go into exported games
## with all resources. The engine finds this class by itself, once the editor has opened the project.


func _get_recognized_extensions() -> PackedStringArray:
	return PackedStringArray(["consac"])


func _handles_type(type: StringName) -> bool:
	return type in [&"Resource", &"ConsacModelFile"]


func _get_resource_type(path: String) -> String:
	return "Resource" if path.get_extension().to_lower() == "consac" else ""


func _get_resource_script_class(path: String) -> String:
	return "ConsacModelFile" if path.get_extension().to_lower() == "consac" else ""


func _load(path: String, _original_path: String, _use_sub_threads: bool, _cache_mode: int) -> Variant:
	var content := FileAccess.get_file_as_bytes(path)
	if content.is_empty():
		return FileAccess.get_open_error() if FileAccess.get_open_error() != OK else ERR_FILE_CORRUPT
	var model := ConsacModelFile.new()
	return model if model.take(content).is_empty() else ERR_FILE_CORRUPT
