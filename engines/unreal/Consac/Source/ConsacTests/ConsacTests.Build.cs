// Copyright CONSAC authors. MIT License.
using UnrealBuildTool;

public class ConsacTests : ModuleRules
{
	public ConsacTests(ReadOnlyTargetRules Target) : base(Target)
	{
		PCHUsage = PCHUsageMode.UseExplicitOrSharedPCHs;
		CppStandard = CppStandardVersion.Cpp20;
		PrivateDependencyModuleNames.AddRange(new string[] { "Core", "CoreUObject", "Engine", "Consac" });
	}
}
