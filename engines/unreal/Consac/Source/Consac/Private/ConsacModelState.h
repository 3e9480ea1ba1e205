// Copyright CONSAC authors. MIT License.
// What is behind a UConsacModel.
#pragma once

#include "CoreMinimal.h"
#include "ConsacCoreInclude.h"

struct FConsacModelState
{
	std::optional<consac::Policy> Policy;  // none until the file is asked for
	bool bTried = false;                   // to read the file of an asset
	std::vector<std::uint8_t> Begins;      // of each row of a call: its agent's episode begins
	std::vector<std::byte> Observations;
	std::vector<std::byte> Actions;
	consac::Rng Rng = consac::Rng(0, 0);
};
