// Copyright CONSAC authors. MIT License.
// Unreal's values as the core's, and back. Pure functions.
#pragma once

#include "CoreMinimal.h"
#include "ConsacCoreInclude.h"
#include "ConsacTypes.h"

namespace ConsacPlugin
{

/** The bytes of an array; they live as long as it stays as it is. */
std::span<const std::byte> BytesOf(const TArray<uint8>& Bytes);
/** A text in UTF-8. */
std::string ToUtf8(const FString& Text);
/** Where a file is: a path that does not begin at a root is one below Saved/Consac of the project. */
std::string ToFile(const FString& Path);
/** The same of a folder that is written to, which is made where it is missing. */
std::string ToFolder(const FString& Path);
/** The same of a folder that a property names; nowhere where it names none. */
std::string ToFolderOrNone(const FString& Path);
/** The same of a file that is to be written: its folder is made. */
std::string ToNewFile(const FString& Path);
/** The longest wait of a tick or a stop, as a property says it. */
double ToSeconds(float Property);
/** A text from UTF-8. */
FString FromUtf8(std::string_view Text);
/** A space; the error says what is wrong with it. */
consac::Result<consac::Space> ToSpace(const FConsacSpace& Space);
/** What a name is over a connection: a packaged game spells a name as whoever came first did, and the same name must be the same text everywhere. */
std::string ToKey(FName Name);
/** Parameters of a world; the error says which has no name. */
consac::Result<std::vector<consac::ParameterSpec>> ToParameters(const TArray<FConsacParameter>& Parameters);
/** What one of them is where nobody sets it. */
consac::Result<double> DefaultOf(const TArray<FConsacParameter>& Parameters, FName Name);
/** A parameter's value for a node: 0 where there is none, and why in the log. */
float ValueOrLog(FName Name, const consac::Result<double>& Value);
/** A number of the game's own for whoever trains; what is wrong with it goes to the log. */
void NoteOrLog(consac::host::TickWorld& World, FName Name, float Value);
/** What a training sets of them, as environment_parameters of a run; empty: nothing. */
std::string ToParameterLaws(const TArray<FConsacParameter>& Parameters);
/** A status as a node's two outputs; a failure is written to the log as well. Returns whether it was a success. */
bool Answer(const consac::Status& Status, EConsacResult& Result, FString& Error);
/** The same where only the text is wanted. */
bool Explain(const consac::Status& Status, FString& Error);
/** How many numbers a row of a layout holds. */
int32 CountOf(const consac::Layout& Layout);
/** Writes a leaf of a row. Fails when there are more or fewer numbers, or one is not finite; the row is then as it was. */
consac::Status WriteLeaf(const consac::Leaf& Leaf, std::byte* Row, const float* Values, int64 Count);
/** Writes a whole row, leaf after leaf. */
consac::Status WriteRow(const consac::Layout& Layout, std::byte* Row, const float* Values, int64 Count);
/** Adds the numbers of a leaf of a row. */
void ReadLeaf(const consac::Leaf& Leaf, const std::byte* Row, TArray<float>& Values);
/** A row as an action. */
FConsacAction ToAction(const consac::Layout& Layout, const std::byte* Row);
/** How a driver stands. */
FConsacProgress ToProgress(const consac::host::Progress& Progress);

}
