#pragma once
template <class T>
class TSubclassOf {};
