// Copyright CONSAC authors. MIT License.
using UnrealBuildTool;

public class ConsacEditor : ModuleRules
{
	public ConsacEditor(ReadOnlyTargetRules Target) : base(Target)
	{
		PCHUsage = PCHUsageMode.UseExplicitOrSharedPCHs;
		CppStandard = CppStandardVersion.Cpp20;
		PrivateDependencyModuleNames.AddRange(new string[] { "Core", "CoreUObject", "Engine", "InputCore", "Slate", "SlateCore", "ToolMenus", "EditorFramework", "UnrealEd", "Consac", "ConsacSamples" });
	}
}
