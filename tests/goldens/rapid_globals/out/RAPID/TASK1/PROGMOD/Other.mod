MODULE Other
  ! golden: the second program.
  LOCAL CONST robtarget S1:=[[1,2,3],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rOther()
    MoveJ pGate,v100,z10,tGun\WObj:=wDoor;
    MoveL pDock,v100,z10,tGun\WObj:=wDoor;
    MoveL S1,v100,z10,tGun\WObj:=wDress;
  ENDPROC
ENDMODULE
