"""Rod and Timoshenko beam of seed 002: contact and friction at the tip of a beam, with numpy and scipy only."""
