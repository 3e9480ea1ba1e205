#pragma once
enum ECollisionChannel { ECC_Visibility };
