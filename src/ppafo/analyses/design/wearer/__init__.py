"""The lightest parts with which a wearer walks for some minutes on a bottle."""
