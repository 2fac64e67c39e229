"""The device for what was given: a wearer, a torque profile, or tasks with what may be chosen for them."""

FOR_A_WEARER = "--mass '72.5 kg' --torque '2.5 N m' --pressure '50 psi_g' --minutes 5"
