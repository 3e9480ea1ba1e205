#pragma once
/// How much a line of the log matters, most first.
namespace ELogVerbosity {
enum Type { NoLogging, Fatal, Error, Warning, Display, Log, Verbose, VeryVerbose };
}
