// Copyright CONSAC authors. MIT License.
using UnrealBuildTool;

public class ConsacSamples : ModuleRules
{
	public ConsacSamples(ReadOnlyTargetRules Target) : base(Target)
	{
		PCHUsage = PCHUsageMode.UseExplicitOrSharedPCHs;
		CppStandard = CppStandardVersion.Cpp20;
		PublicDependencyModuleNames.AddRange(new string[] { "Core", "CoreUObject", "Engine", "Consac" });
	}
}
