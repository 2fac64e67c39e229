"""Which device: for a wearer, for a torque profile, or beaten by no other in error, gas and mass?"""
